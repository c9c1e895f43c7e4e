"""The guide's picture of an appraised print: what its page prints in silico, and finds."""

from __future__ import annotations

import io
import tempfile
from contextlib import chdir
from pathlib import Path

from PIL import Image

from geoprint.account.appraised.picture import photograph_overlay
from geoprint.config import job_of
from geoprint.guide import page_named
from geoprint.pipeline import plan, save_plan
from geoprint.pipeline.appraised.photographs import PlanAsked, appraise_photographs

# Width of the picture [px], and colours that it keeps.
WIDTH, COLOURS = 720, 128


def appraised(data: Path) -> bytes:
    """Draw what the page finds in the photograph that its own block makes."""
    blocks = page_named("appraise").blocks
    (made,) = (block.text for block in blocks if block.language == "python")
    (lens,) = (block.text for block in blocks if block.word == "lens.toml")
    data = data.resolve()
    job = job_of(surface=data / "plate.ply", unit="mm", spacing=3.5, backend="fast-marching", robot=False)
    with tempfile.TemporaryDirectory() as folder, chdir(folder):
        Path("data").symlink_to(data)
        save_plan(plan(job), "planned")
        exec(compile(made, "appraise.md", "exec"), {"__name__": "appraise"})  # noqa: S102  (our own text)
        Path("lens.toml").write_text(lens, encoding="utf-8")
        asked = PlanAsked(Path("planned"), (Path("marks.csv"),), (Path("lens.toml"),))
        found = appraise_photographs(["print.png"], against=asked)
    picture = Image.open(io.BytesIO(photograph_overlay(found.photographs[0])))
    small = picture.resize((WIDTH, round(picture.height * WIDTH / picture.width)), Image.Resampling.LANCZOS)
    written = io.BytesIO()
    # By octree, because few pixels have the colours of the lines and the others would outvote them.
    small.quantize(COLOURS, method=Image.Quantize.FASTOCTREE).save(written, format="PNG", optimize=True)
    return written.getvalue()
