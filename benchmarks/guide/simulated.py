"""The guide's picture of prints in silico: a program as it was written, and with the edit of its page."""

from __future__ import annotations

import io
import tempfile
from contextlib import chdir
from pathlib import Path

from PIL import Image

from geoprint.config import job_of
from geoprint.guide import page_named
from geoprint.pipeline import plan, save_plan
from geoprint.pipeline.appraised.simulated import save_simulated, simulated_print
from geoprint.silico import Faults

# Width of each of the two photographs [px], and between them; grey values that the picture keeps.
WIDTH, BETWEEN, GREYS = 380, 12, 64
SPREAD = 0.5


def simulated(data: Path) -> bytes:
    """Draw what a program lays as it was written, and beside it what it lays after the page's own edit."""
    (edit,) = (block.text for block in page_named("simulate").blocks if block.language == "python")
    faults = Faults(width_scale=SPREAD, width_noise=0.05)
    data = data.resolve()
    with tempfile.TemporaryDirectory() as folder, chdir(folder):
        save_plan(plan(job_of(surface=data / "plate.ply", unit="mm", spacing=3.5, place="demo")), "programmed")
        save_simulated(simulated_print(Path("programmed"), faults=faults, seed=0), "before")
        exec(compile(edit, "simulate.md", "exec"), {"__name__": "simulate"})  # noqa: S102  (our own text)
        save_simulated(simulated_print(Path("programmed"), faults=faults, seed=0), "after")
        pictures = [Image.open(Path(name, "print.png")).convert("L") for name in ("before", "after")]
    small = [each.resize((WIDTH, WIDTH), Image.Resampling.LANCZOS) for each in pictures]
    both = Image.new("L", (2 * WIDTH + BETWEEN, WIDTH), 255)
    both.paste(small[0], (0, 0))
    both.paste(small[1], (WIDTH + BETWEEN, 0))
    written = io.BytesIO()
    both.quantize(GREYS).save(written, format="PNG", optimize=True)
    return written.getvalue()
