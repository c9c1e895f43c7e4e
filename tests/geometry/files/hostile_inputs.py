"""Every broken file of the shared data, each planned in a bounded process of its own, and what must become of it.

`python -m tests.geometry.files.hostile_inputs` plans them all, prints the table and fails where an outcome is not the
expected one.
"""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from tests.shared_data import SHARED_DATA

SECONDS = 60
MEMORY = 2 << 30
CASES = SHARED_DATA / "broken" / "crafted_cases.json"
FILES = sorted(path.name for path in (SHARED_DATA / "broken").glob("*") if path.suffix != ".json")

# What becomes of each crafted case: status, and words of the outcome that name the defect or the repair.
INSIDE_OUT = "which is hollow: check whether the file is mirrored or its faces are flipped"
WELDED = (0, "1903 vertices joined")
EXPECTED: dict[str, tuple[int, str]] = {
    "x_nan_vertex.ply": (3, "NaN or infinite coordinates: 1, the first is vertex 208"),
    "x_inf_vertex.stl": (3, "NaN or infinite coordinates: 5"),
    "x_truncated.stl": (3, "t is cut off or damaged"),
    "x_count_too_large.stl": (3, "announces 4294967295 triangles"),
    "x_solid_header_binary.stl": WELDED,
    "x_zero_bytes.stl": (3, "is empty (0 bytes)"),
    "x_text_not_a_mesh.stl": (3, "is not an STL file"),
    "x_lfs_pointer.ply": (3, "is a git-LFS pointer"),
    "x_ply_named.stl": (3, "is a PLY file by its content"),
    "x_ply_huge_header.ply": (3, "promises 2000000000 of `vertex`"),
    "x_index_out_of_range.ply": (3, "face 369 refers to vertex 445, but there are 440"),
    "x_decimal_comma.obj": (3, "numbers with decimal points"),
    "x_crlf_bom.obj": (0, "written and verified"),
    "x_duplicate_faces.ply": (0, "260 duplicate faces dropped"),
    "x_both_sides.ply": (0, "781 duplicate faces dropped"),
    "x_random_flips.ply": (0, "237 faces turned for one winding"),
    "x_all_flipped.ply": (0, INSIDE_OUT),
    "x_mirrored.ply": (0, INSIDE_OUT),
    "x_metres.ply": (3, "it would be 28.6 mm with `--unit m`"),
    "x_inches.stl": (0, "with `--unit in` it would be 28.6 mm: check the unit"),
    "x_far_offset.stl": (3, "lies 2 km from the origin"),
    "x_normalised.ply": (0, "check the unit"),
    "x_cracked_soup.stl": WELDED,
    "x_noise_0p3mm.ply": (0, "written and verified"),
    "x_two_patches.ply": (3, "has 2 separate components"),
    "x_pinhole.ply": (0, "1 holes closed, at ("),
    "x_fin.ply": (3, "edges with more than two faces: 1, the first at (130.57, 76.44, 37.72) mm"),
    "x_bowtie.ply": (3, "has 2 separate components"),
    "x_rolled_overhang.ply": (0, "written and verified"),
    "x_folded_selfintersect.ply": (3, "intersects itself"),
    "x_t_junction.ply": (0, "1 faces added where vertices lie on edges"),
    "x_slit_unwelded.ply": (0, "11 vertices joined"),
    "x_slivers_zero_area.ply": (0, "30 faces without area dropped"),
    "x_unreferenced_vertices.ply": (0, "200 vertices that no face uses dropped"),
    "x_single_triangle.ply": (0, "written and verified"),
    "x_flat_coarse.ply": (0, "written and verified"),
    "x_zip_200MB_zeros.zip": (3, "to 200000000 bytes. At most 100 times its packed size"),
}


@dataclass(frozen=True)
class Outcome:
    status: int
    seconds: float
    text: str


def bounded() -> None:
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    resource.setrlimit(resource.RLIMIT_CPU, (SECONDS, SECONDS))


# Runs commands one after the other, each of which would end the process, and tells status and text of each.
IN_TURN = """
import contextlib, io, json, sys
from geoprint import cli
for command in json.loads(sys.argv[1]):
    sys.argv = ["geoprint", *command]
    told, status = io.StringIO(), 0
    with contextlib.redirect_stderr(told):
        try:
            cli.main()
        except SystemExit as ended:
            status = ended.code or 0
    print(json.dumps([status, told.getvalue()]))
"""


def planned_in_turn(paths: Sequence[Path], *arguments: str, outs: Sequence[Path]) -> list[Outcome]:
    """Plan files one after the other in one process, which has the time and the memory that one file may take."""
    commands = [
        ["plan", str(path), "--no-robot", "--rounds", "6", "--out", str(out), *arguments]
        for path, out in zip(paths, outs, strict=True)
    ]
    done = subprocess.run(
        [sys.executable, "-c", IN_TURN, json.dumps(commands)],
        capture_output=True, text=True, check=False, preexec_fn=bounded, timeout=5 * SECONDS,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    record: list[tuple[int, str]] = [json.loads(line) for line in done.stdout.splitlines() if line.startswith("[")]
    assert len(record) == len(commands), done.stdout
    return [Outcome(status, 0.0, text.strip()) for status, text in record]


def planned(path: Path, *arguments: str, out: Path) -> Outcome:
    """Plan a file in a process of its own, which is ended where it takes too long or too much."""
    command = [sys.executable, "-m", "geoprint", "plan", str(path), "--no-robot", "--rounds", "6", "--out", str(out)]
    started = time.perf_counter()
    done = subprocess.run(
        [*command, *arguments], capture_output=True, text=True, check=False, preexec_fn=bounded, timeout=5 * SECONDS
    )
    return Outcome(done.returncode, time.perf_counter() - started, done.stderr.strip())


def check(name: str, found: Outcome, out: Path) -> None:
    """Fail where an outcome is neither a written plan nor a refusal in one sentence that names the file.

    Of a crafted case the outcome must also be the expected one.
    """
    assert found.status in {0, 3, 4}, f"{name}: {found}"
    assert "Traceback" not in found.text, found.text
    if found.status == 0:
        assert json.loads((out / "plan.json").read_text())["paths"]["deposit_mm"] > 0
    else:
        assert not out.exists()
        assert found.text.startswith("geoprint: ")
        assert "\n" not in found.text
        assert name in found.text
    status, words = EXPECTED.get(name, (found.status, ""))
    assert found.status == status, found.text
    assert words in found.text, found.text


def table() -> None:
    """Print what becomes of every file."""
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(os.cpu_count()) as pool:
        outs = [Path(folder) / name for name in FILES]
        runs = [
            pool.submit(planned, SHARED_DATA / "broken" / name, "--unit", "mm", out=out)
            for name, out in zip(FILES, outs, strict=True)
        ]
        for name, out, run in zip(FILES, outs, runs, strict=True):
            found = run.result()
            check(name, found, out)
            sys.stdout.write(f"{name:<42}{found.status:>2}{found.seconds:7.1f} s  {found.text.splitlines()[0]}\n")


if __name__ == "__main__":
    table()
