"""How thick does a stack of layers become, and how much of its volume is laid?

    python -m benchmarks.stacks [FILE ...] [--thickness MM] [--height MM] [--spacing MM] [--backend NAME] [--smoke]

Every layer is planned without a robot, and what it lays is simulated on its own surface, as `benchmarks.uniformity` has
it for one skin. The thickness of all layers together is taken along columns that stand upright on the part, evenly by
area, and compared with the thickness that was asked for. Columns that meet others in a crease before are left out,
those that leave the stack through a side before are judged up to there, and the shares of both are told. Parts are a
cap, a tube and a plate by formula, and any mesh files [mm].
"""

from __future__ import annotations

import argparse
import tempfile
import time
from pathlib import Path

from benchmarks.parts.tables import row, table
from geoprint.account.records.stack import FinishedRecord
from geoprint.config import job_of, packaged_cell_text
from geoprint.errors import GeoprintError
from geoprint.model import Surface
from geoprint.pipeline import plan_stack
from geoprint.surfaces.files import save_ply
from tests.meshes import cylinder_patch, plate, spherical_cap

# The packaged cell's line that says how high a layer is.
HEIGHT_LINE = "layer_height_mm = 0.5"
COLUMNS = (
    "part", "layers", "laid over wanted: constant", "follows", "thickness CV: constant", "follows", "1 to 99 of 100",
    "within 5 %", "in creases", "under sides", "time",
)  # fmt: skip


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("parts", nargs="*", type=Path, metavar="FILE", help="meshes [mm] instead of those by formula")
    parser.add_argument("--thickness", type=float, default=3.2, metavar="MM")
    parser.add_argument("--height", type=float, default=0.4, metavar="MM", help="of a layer")
    parser.add_argument("--spacing", type=float, default=0.4, metavar="MM")
    parser.add_argument("--backend", default="heat", metavar="NAME")
    parser.add_argument("--smoke", action="store_true", help="a coarse layer of a small plate")
    arguments = parser.parse_args()
    for line in table(*COLUMNS):
        print(line, flush=True)
    with tempfile.TemporaryDirectory() as folder:
        for part in arguments.parts or _formulas(Path(folder), smoke=arguments.smoke):
            text = _row(
                part,
                Path(folder),
                thickness=0.5 if arguments.smoke else arguments.thickness,
                height=0.5 if arguments.smoke else arguments.height,
                spacing=3.0 if arguments.smoke else arguments.spacing,
                backend=arguments.backend,
            )
            print(text, flush=True)


def _formulas(folder: Path, *, smoke: bool) -> list[Path]:
    """Write the parts by formula, and return where they are."""
    made = [plate((6.0, 5.0), (6, 5))] if smoke else [plate((12.0, 10.0), (12, 10))]
    if not smoke:
        made += [
            spherical_cap(radius=20.0, angle=0.5, rings=40),
            cylinder_patch(radius=15.0, angle=1.2, length=18.0, divisions=(60, 30)),
        ]
    return [_saved(folder, surface) for surface in made]


def _saved(folder: Path, surface: Surface) -> Path:
    path = folder / f"{surface.name}.ply"
    save_ply(surface, path)
    return path


def _row(part: Path, folder: Path, *, thickness: float, height: float, spacing: float, backend: str) -> str:
    """Return the line of a part."""
    cell = folder / "cell.toml"
    text = packaged_cell_text("irb120-bent45").replace(HEIGHT_LINE, f"layer_height_mm = {height:g}")
    cell.write_text(text, encoding="utf-8")
    begun = time.monotonic()
    try:
        job = job_of(
            surface=part, unit="mm", spacing=spacing, thickness=thickness, cell=cell, backend=backend, robot=False
        )
        told = plan_stack(job, folder / f"{part.stem}-{backend}")
    except GeoprintError as error:
        return row(part.stem, str(error)[:200].replace("|", "/"), *[""] * (len(COLUMNS) - 2))
    constant, following = told.finished.constant_flow, told.finished.following_flow
    assert constant is not None
    assert following is not None
    return row(
        part.stem, str(len(told.layers)), f"{constant.volume:.2%}", f"{following.volume:.2%}", f"{constant.cv:.2%}",
        f"{following.cv:.2%}", _between(following), f"{following.within_5_percent:.1%}", f"{following.creased:.2%}",
        f"{following.under_sides:.2%}",
        f"{time.monotonic() - begun:.0f} s",
    )  # fmt: skip


def _between(found: FinishedRecord) -> str:
    return f"{found.p1:.3f} - {found.p99:.3f}"


if __name__ == "__main__":
    main()
