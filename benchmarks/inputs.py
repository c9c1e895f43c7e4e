"""What do loading, inspecting and preparing a large STL file cost? Prints a Markdown table.

    python -m benchmarks.inputs [--smoke]

A binary STL file of a spherical cap, its triangles in random order, is read, joined, repaired and examined, and read by
trimesh in the same run. Seconds are processor time of this process, which other work on the machine does not change
much; the ratio is to trimesh's own load, which joins equal corners and repairs nothing.
"""

from __future__ import annotations

import argparse
import resource
import tempfile
import time
from collections.abc import Callable
from io import BytesIO
from pathlib import Path
from typing import TypeVar

import numpy as np

from benchmarks.parts.surfaces import make
from benchmarks.parts.tables import row, rule
from geoprint.model import Surface
from geoprint.surfaces.files import load
from geoprint.surfaces.repair import inspect, prepare

Result = TypeVar("Result")

FACES, SMOKE_FACES = 1_000_000, 20_000


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--smoke", action="store_true", help="a small file, to see that the script runs")
    count = SMOKE_FACES if parser.parse_args().smoke else FACES
    with tempfile.TemporaryDirectory() as folder:
        warm = write_stl(make("cap", faces=2_000), Path(folder) / "warm.stl")
        inspect(load(warm, unit="mm"))  # Compiles.
        path = write_stl(make("cap", faces=count), Path(folder) / "cap.stl")
        for line in table(path):
            print(line, flush=True)


def write_stl(surface: Surface, path: Path) -> Path:
    """Write a binary STL file with its triangles in random order."""
    order = np.random.default_rng(0).permutation(len(surface.faces))
    triangles = np.zeros(len(order), dtype=[("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("rest", "<u2")])
    triangles["corners"] = surface.vertices[surface.faces[order]]
    path.write_bytes(bytes(80) + len(order).to_bytes(4, "little") + triangles.tobytes())
    return path


def table(path: Path) -> list[str]:
    """Return the lines of the table for one file."""
    import trimesh

    surface, loading = seconds(lambda: load(path, unit="mm"))
    _, preparing = seconds(lambda: prepare(surface))
    (found, inspecting), memory = seconds(lambda: inspect(surface)), peak_gigabytes()
    _, peer = seconds(
        lambda: trimesh.load_mesh(BytesIO(path.read_bytes()), file_type="stl", process=True, fix_texture=False)
    )
    steps = (("load", loading), ("prepare", preparing), ("inspect (prepares too)", inspecting))
    return [
        f"{len(surface.faces)} faces, {found.examined.vertices.shape[0]} vertices joined; at most {memory:.1f} GB",
        "",
        row("step", "processor time", "over trimesh's load"),
        rule(3),
        *(row(name, f"{used:.1f} s", f"{used / peer:.2f}") for name, used in steps),
        row("load and inspect", f"{loading + inspecting:.1f} s", f"{(loading + inspecting) / peer:.2f}"),
        row("trimesh: load", f"{peer:.1f} s", "1"),
    ]


def seconds(work: Callable[[], Result]) -> tuple[Result, float]:
    """Return a result and the processor time that it took [s]."""
    start = time.process_time()
    result = work()
    return result, time.process_time() - start


def peak_gigabytes() -> float:
    """Return the largest memory of this process so far."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20


if __name__ == "__main__":
    main()
