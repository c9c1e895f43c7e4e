"""The guide's pictures of simulated prints: photographed, edited programs, and the three of the paper."""

# matplotlib leaves the keyword arguments of its methods untyped.
# pyright: reportUnknownMemberType=false

from __future__ import annotations

import io
import tempfile
from contextlib import chdir
from pathlib import Path

from matplotlib.figure import Figure
from PIL import Image

from benchmarks.guide.shaded import DOTS_PER_INCH
from benchmarks.guide.stamps import with_figures
from benchmarks.paper.__main__ import PARTS, SEED
from benchmarks.paper.comparing import Compared, compared
from benchmarks.paper.prints import fixed_printing, studio_of
from geoprint.config import job_of
from geoprint.guide import page_named
from geoprint.inspection.appraise_photographs import PlanAsked, appraise_photographs
from geoprint.inspection.records import photograph_overlay
from geoprint.inspection.simulated import simulated_print
from geoprint.model import PASCAL_PER_KPA
from geoprint.simulation import Faults
from geoprint.workflow import plan, save, save_plan

# Width of the picture [px], and colours that it keeps.
WIDTH, COLOURS = 720, 128


def appraised(data: Path) -> bytes:
    """Draw what the page finds in the photograph that its own block makes."""
    blocks = page_named("inspection").blocks
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


# Width of each of the two photographs [px], and between them; grey values that the picture keeps.
SIMULATED_WIDTH, BETWEEN, GREYS = 380, 12, 64
SPREAD = 0.5


def simulated(data: Path) -> bytes:
    """Draw what a program lays as it was written, and beside it what it lays after the page's own edit."""
    (edit,) = (block.text for block in page_named("simulate").blocks if block.language == "python")
    faults = Faults(width_scale=SPREAD, width_noise=0.05)
    data = data.resolve()
    with tempfile.TemporaryDirectory() as folder, chdir(folder):
        save_plan(plan(job_of(surface=data / "plate.ply", unit="mm", spacing=5.0, place="demo")), "programmed")
        before = simulated_print(Path("programmed"), faults=Faults(), seed=0)
        save(simulated_print(Path("programmed"), faults=faults, seed=0), "before")
        exec(compile(edit, "simulate.md", "exec"), {"__name__": "simulate"})  # noqa: S102  (our own text)
        after = simulated_print(Path("programmed"), faults=faults, seed=0)
        save(after, "after")
        pictures = [Image.open(Path(name, "print.png")).convert("L") for name in ("before", "after")]
    small = [each.resize((SIMULATED_WIDTH, SIMULATED_WIDTH), Image.Resampling.LANCZOS) for each in pictures]
    both = Image.new("L", (2 * SIMULATED_WIDTH + BETWEEN, SIMULATED_WIDTH), 255)
    both.paste(small[0], (0, 0))
    both.paste(small[1], (SIMULATED_WIDTH + BETWEEN, 0))
    written = io.BytesIO()
    both.quantize(GREYS).save(written, format="PNG", optimize=True)
    figures = [f"{each.deposited.sum() / each.wanted.sum():.3f}" for each in (before, after)]
    return with_figures(written.getvalue(), figures)


# Of the figure [inches].
PAPER_WIDTH, HEIGHT = 4.8, 3.4
# Greys that the picture keeps: the grain of the photographs would fill a larger file with more.
PAPER_GREYS = 16


def paper(data: Path) -> bytes:
    """Draw the prints of Table I on the free wall of the heart, as all that the paper does not say is fixed."""
    studio = studio_of(data / PARTS[0], body=data / "heart.ply")
    found = compared(studio, fixed_printing(), seed=SEED)
    figures = [f"{found.distances[pair].hausdorff:.1f}" for pair in (("A", "B"), ("A", "C"), ("B", "C"))]
    return with_figures(paper_picture(found), figures)


def paper_picture(found: Compared) -> bytes:
    """Draw three photographs, and below them what is compared."""
    figure = Figure(figsize=(PAPER_WIDTH, HEIGHT), dpi=DOTS_PER_INCH, layout="constrained")
    above, below = figure.subplots(2, len(found.prints))
    for axis, under, each, edges in zip(above, below, found.prints, found.edges, strict=True):
        case = each.case
        axis.imshow(each.grey, cmap="gray", vmin=0.0, vmax=1.0)
        axis.set_title(f"{case.name}: {case.pressure / PASCAL_PER_KPA:g} kPa, {case.rounds} rounds", fontsize=9)
        under.imshow(edges, cmap="gray_r", vmin=0.0, vmax=1.0)
        for one in (axis, under):
            one.axis("off")
    drawn, written = io.BytesIO(), io.BytesIO()
    figure.savefig(drawn, format="png", metadata={"Software": None})
    grey = Image.open(drawn).convert("L")
    grey.quantize(PAPER_GREYS, dither=Image.Dither.NONE).save(written, format="png", optimize=True)
    return written.getvalue()
