"""The pictures of the gallery: each script of `geoprint/guide/examples` is run, and what it draws is made small."""

from __future__ import annotations

import hashlib
import runpy
import tempfile
from collections.abc import Iterable
from contextlib import chdir
from pathlib import Path

import matplotlib.pyplot as plt

import geoprint
from benchmarks.guide.shaded import smaller
from benchmarks.guide.stamps import MADE_FROM, stamped

EXAMPLES = Path(geoprint.__file__).parent / "guide" / "examples"
# Of a picture [px].
WIDTH = 840


def draw_gallery(names: Iterable[str], data: Path) -> None:
    """Write the pictures of some scripts beside them, and say how large they are."""
    for name in sorted(names):
        script = EXAMPLES / f"{name}.py"
        picture = stamped(example_picture(script, data), MADE_FROM, script_stamp(script))
        (EXAMPLES / f"{name}.png").write_bytes(picture)
        print(f"{name}.png: {len(picture)} bytes")


def script_stamp(script: Path) -> str:
    """Return a hash of a script, whose comments do not count."""
    lines = [line for line in script.read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
    return hashlib.sha256("\n".join(lines).encode()).hexdigest()[:16]


def example_picture(script: Path, data: Path) -> bytes:
    """Run a script in a folder that is thrown away, and return the picture that it draws.

    Args:
        script: of the gallery.
        data: the folder that scripts call `data`.
    """
    plt.switch_backend("agg")
    with tempfile.TemporaryDirectory() as folder, chdir(folder):
        Path("data").symlink_to(data.resolve())
        runpy.run_path(str(script), run_name="__main__")
        plt.close("all")
        return smaller(Path(f"{script.stem}.png").read_bytes(), width=WIDTH)
