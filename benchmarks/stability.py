"""Does a plan depend on the last bit: of the part's coordinates, of the processor, of how many threads there are?

    python -m benchmarks.stability [FILE ...] [--spacing MM] [--backend NAME ...] [--smoke]

Each part is planned with the default settings in the packaged cell as it is, with its vertices moved by 1e-9 mm, on
another kind of processor (kernels of OpenBLAS and numba for an old one, no wide instructions of NumPy) and with several
threads; each in a process of its own. What may differ: nothing of the runs, 0.5 % of the speed, 1 % of the targets and
0.02 points of CV, gap and overlap. The table has the largest difference of each; what is beyond is marked with !.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType

import numpy as np

from benchmarks.parts.tables import row, table
from geoprint import job_of, plan
from geoprint.errors import GeoprintError
from geoprint.model import Surface
from geoprint.surfaces.files import load, save_ply, suggested_unit

DATA = Path(__file__).parents[1] / "data"
OWN = tuple(DATA / name for name in ("plate.ply", "heart_flat_patch.ply", "heart_apex_patch.ply"))
BACKENDS = ("lscm", "heat")
# Standard deviation by which vertices are moved [mm].
MOVED = 1e-9
# What NumPy uses here beside the instructions that every processor of this kind has.
WIDE = " ".join(np.show_config(mode="dicts")["SIMD Extensions"].get("found", ()))
CHANGES: Mapping[str, Mapping[str, str]] = MappingProxyType(
    {
        "moved by 1e-9 mm": {},
        "old processor": {
            "OPENBLAS_CORETYPE": "Nehalem",
            "NUMBA_CPU_NAME": "generic",
            "NUMBA_ENABLE_AVX": "0",
            "NPY_DISABLE_CPU_FEATURES": WIDE,
        },
        "two threads": {"OPENBLAS_NUM_THREADS": "2", "OMP_NUM_THREADS": "2"},
    }
)
# Figures of a plan, and how far they may differ: as a share, or in points where they are percentages.
RELATIVE = MappingProxyType({"mm/s": 0.005, "targets": 0.01})
POINTS = MappingProxyType({"CV": 0.02, "gap": 0.02, "overlap": 0.02})


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="*", type=Path, default=OWN, metavar="FILE")
    parser.add_argument("--spacing", type=float, default=2.0, metavar="MM")
    parser.add_argument("--backend", nargs="+", default=BACKENDS, metavar="NAME")
    parser.add_argument("--smoke", action="store_true", help="one part, wide apart, to see that the script runs")
    parser.add_argument("--one", action="store_true", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    files, backends, spacing = arguments.files, arguments.backend, arguments.spacing
    if arguments.one:
        print(json.dumps(figures(files[0], backend=backends[0], spacing=spacing)))
        return
    if arguments.smoke:
        files, backends, spacing = files[:1], backends[:1], 8.0
    for line in report(files, backends=backends, spacing=spacing):
        print(line, flush=True)


def report(files: Sequence[Path], *, backends: Sequence[str], spacing: float) -> Iterator[str]:
    """Yield the table, a line a part, backend and change."""
    yield from table(f"part, {spacing:g} mm", "backend", "change", "runs", *RELATIVE, *POINTS)
    for file in files:
        for backend in backends:
            with tempfile.TemporaryDirectory() as folder:
                own, moved = (Path(folder) / f"{name}.ply" for name in ("own", "moved"))
                surface = load(file, unit=suggested_unit(file)[0])
                noise = np.random.default_rng(0).normal(scale=MOVED, size=surface.vertices.shape)
                save_ply(surface, own)
                save_ply(Surface(vertices=surface.vertices + noise, faces=surface.faces, name="moved"), moved)
                found = _asked(own, {}, backend=backend, spacing=spacing)
                for change, environment in CHANGES.items():
                    other = _asked(own if environment else moved, environment, backend=backend, spacing=spacing)
                    yield row(file.stem, backend, change, *differences(found, other))


def figures(file: Path, *, backend: str, spacing: float) -> dict[str, float | str]:
    """Return what must not depend on the last bit: runs, speed, targets, evenness, or why there is no plan."""
    try:
        planned = plan(job_of(surface=file, unit="mm", spacing=spacing, backend=backend, place="demo"))
    except GeoprintError as error:
        return {"refused": type(error).__name__}
    measured, robot = planned.uniformity, planned.robot[0]
    assert measured is not None
    return {
        "runs": measured.run_count,
        "mm/s": planned.workpiece.cell.process.speed,
        "targets": len(robot.targets.poses),
        "CV": 100.0 * measured.thickness.cv,
        "gap": 100.0 * measured.gap,
        "overlap": 100.0 * measured.overlap,
    }


def differences(found: Mapping[str, float | str], other: Mapping[str, float | str]) -> list[str]:
    """Return a cell for each figure: what it is both times, and a mark where it differs by more than it may."""
    if "refused" in found or "refused" in other:
        same = found.get("refused") == other.get("refused")
        return [
            f"{found.get('refused', 'planned')}, {other.get('refused', 'planned')}{'' if same else ' !'}",
            *[""] * 5,
        ]
    cells = [f"{found['runs']}, {other['runs']}{'' if found['runs'] == other['runs'] else ' !'}"]
    for name, allowed in (*RELATIVE.items(), *POINTS.items()):
        one, two = float(found[name]), float(other[name])
        off = abs(two - one) / one if name in RELATIVE else abs(two - one)
        cells.append(f"{one:.4g}, {two:.4g}{' !' if off > allowed else ''}")
    return cells


def _asked(file: Path, environment: Mapping[str, str], *, backend: str, spacing: float) -> dict[str, float | str]:
    """Return the figures of a plan that is made in another process."""
    command = [sys.executable, "-m", "benchmarks.stability", str(file), "--one", "--backend", backend]
    done = subprocess.run(  # noqa: S603
        [*command, "--spacing", str(spacing)], env=os.environ | environment, check=True, capture_output=True, text=True
    )
    found: dict[str, float | str] = json.loads(done.stdout)
    return found


if __name__ == "__main__":
    main()
