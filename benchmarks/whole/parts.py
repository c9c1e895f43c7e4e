"""Large parts, made when they are first asked for and kept as long as the process that times them runs."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from benchmarks.parts.surfaces import cap, triangulated
from geoprint.model import Surface
from geoprint.surfaces.files import save_ply
from tests.meshes import sphere

# Names the folder in which parts are kept to the processes that are timed.
FOLDER = "BENCHMARK_PARTS"
PARTS: Mapping[str, Callable[[], Surface]] = {
    "SPHERE": lambda: sphere(radius=40.0, subdivisions=8),
    "CAP": lambda: triangulated(cap(40.0, depth=30.0), name="cap", faces=10_000),
}


@cache
def part_file(name: str) -> Path:
    """Return a file with a part of that name."""
    path = Path(folder_of_parts().name, f"{name.lower()}.ply")
    save_ply(PARTS[name](), path)
    return path


@cache
def folder_of_parts() -> TemporaryDirectory[str]:
    """Return the folder, which goes when this process does."""
    return TemporaryDirectory()


@cache
def cap_of(faces: int) -> Surface:
    """Return an irregular mesh of a cap of 70 degrees, with about so many faces, from the folder or for it."""
    kept = Path(os.environ[FOLDER], f"cap_{faces}.npz")
    if not kept.exists():
        made = triangulated(cap(70.0), name="cap", faces=faces, style="irregular")
        np.savez(kept, vertices=made.vertices, faces=made.faces)
    with np.load(kept) as arrays:
        return Surface(arrays["vertices"], arrays["faces"], name="cap")
