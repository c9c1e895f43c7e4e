"""Do plans and comparisons still say the same, byte for byte? Twelve bundles, held against their recorded hashes.

    python -m benchmarks.golden [--cases NAME ...] [--keep DIR] [--record]

Planned with the command line, so that nothing inside geoprint is asked. Of every RAPID module, CSV and JSON file the
hash is compared with `tests/golden/hashes.json`; `timings.json` alone differs from run to run.
The last bits of a number depend on the machine's linear algebra: the hashes hold on the machine that recorded them, so
before a change that shall leave everything as it is, record them on your own with `--record`. The bundle `small` stands
whole in `tests/golden/small`; `tests/test_golden.py` holds a plan of any machine against it, number by number.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parents[1]
GOLDEN = ROOT / "tests" / "golden"
HASHES = GOLDEN / "hashes.json"
# What RAPID, tables and figures are written in; pictures and pages are looked at instead.
SUFFIXES = {".mod", ".pgf", ".csv", ".json"}
# Seconds differ from run to run; manifest.json has the hash of every file, pictures and meshes among them.
UNSTEADY = {"timings.json", "manifest.json"}
DEMO = ("--unit", "mm", "--place", "demo")
# The second cell that comes with geoprint, as `geoprint init` writes it.
STRAIGHT = "irb120-straight160.toml"
# The small bundle: a disc of 4 mm about the middle of the plate.
SMALL = ("plan", "data/plate.ply", *DEMO, "--at", "0", "0", "0", "--radius", "4", "--spacing", "2")
# Name to command line, without its result's folder.
CASES: dict[str, tuple[str, ...]] = {
    "small": SMALL,
    "plate": ("compare", "data/plate.ply", *DEMO, "--spacing", "3", "--backends", "all", "--samples"),
    "apex-marching": (
        "plan", "data/heart_apex_patch.ply", *DEMO, "--spacing", "2", "--body", "data/heart.ply",
        "--backend", "fast-marching",
    ),
    "apex-upright": ("plan", "data/heart_apex_patch.ply", *DEMO, "--spacing", "4", "--max-tilt", "0"),
    "flat-lscm": (
        "plan", "data/heart_flat_patch.ply", *DEMO, "--spacing", "3", "--backend", "lscm", "--resolution", "300",
    ),
    "flat-heat": ("plan", "data/heart_flat_patch.ply", *DEMO, "--spacing", "2", "--on-slowdown", "follow"),
    "analog": ("plan", "data/plate.ply", "--unit", "mm", "--spacing", "3", "--cell", "tests/golden/analog.toml"),
    "straight": ("plan", "data/plate.ply", *DEMO, "--rounds", "4", "--cell", STRAIGHT),
    "paper": ("plan", "data/heart_flat_patch.ply", *DEMO, "--cell", "data/paper_case_a.toml"),
    "seed-lscm": (
        "plan", "data/heart_flat_patch.ply", *DEMO, "--spacing", "3", "--backend", "lscm",
        "--from", "point:41.7,4.6,-5.9",
    ),
    "two-patches": ("compare", "tests/golden/two_patches.toml"),
    "paths": (
        "compare", "data/heart_apex_patch.ply", "data/plate.ply", "--unit", "mm", "--spacing", "2", "--no-robot",
        "--backends", "all",
    ),
}  # fmt: skip


def main() -> None:
    """Plan the cases and compare or record their hashes; ends with 1 where one differs."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", nargs="+", choices=CASES, default=list(CASES), help="only these")
    parser.add_argument("--keep", type=Path, help="leave the bundles in this new folder, to look for what differs")
    parser.add_argument("--record", action="store_true", help="record the hashes and the small bundle")
    parser.add_argument("--smoke", action="store_true", help="the small bundle only, without comparing")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        folder = arguments.keep or Path(temporary)
        folder.mkdir(exist_ok=True)
        names = ["small"] if arguments.smoke else arguments.cases
        found = {name: hashes(planned(name, folder / name)) for name in names}
        if arguments.record:
            _record(found)
            if "small" in found:
                _record_small(folder / "small")
        elif not arguments.smoke:
            sys.exit(_report(found))


def planned(name: str, folder: Path) -> Path:
    """Plan a case into a folder that does not exist yet, as a user would; return the folder."""
    with tempfile.TemporaryDirectory() as cells:
        asked = CASES[name]
        if STRAIGHT in asked:
            _geoprint("init", cells)
            asked = [str(Path(cells) / one) if one == STRAIGHT else one for one in asked]
        _geoprint(*asked, "--out", str(folder))
    return folder


def hashes(folder: Path) -> dict[str, str]:
    """Return the SHA-256 of each program, table and JSON file of a bundle, by its name there."""
    return {
        path.relative_to(folder).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(folder.rglob("*"))
        if path.suffix in SUFFIXES and path.name not in UNSTEADY
    }


def _geoprint(*arguments: str) -> None:
    command = [sys.executable, "-m", "geoprint", *arguments]
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True)  # noqa: S603  (no name from outside)


def _record(found: dict[str, dict[str, str]]) -> None:
    known: dict[str, dict[str, str]] = json.loads(HASHES.read_text(encoding="utf-8")) if HASHES.exists() else {}
    HASHES.write_text(json.dumps(known | found, indent=1) + "\n", encoding="utf-8")
    print(f"recorded {sum(map(len, found.values()))} files of {len(found)} bundles")


def _record_small(bundle: Path) -> None:
    """Take over the files of the small bundle that stand beside the hashes."""
    kept = GOLDEN / "small"
    for path in sorted(path for path in kept.rglob("*") if path.is_file()):
        path.write_bytes((bundle / path.relative_to(kept)).read_bytes())


def _report(found: dict[str, dict[str, str]]) -> int:
    """Print how each bundle stands to its record, and return how many do not keep it."""
    recorded = json.loads(HASHES.read_text(encoding="utf-8"))
    wrong = 0
    for name, files in found.items():
        differing = [file for file in {**recorded[name], **files} if recorded[name].get(file) != files.get(file)]
        wrong += bool(differing)
        print(f"{name:16}{len(files):4} files  " + ("the same" if not differing else f"DIFFER: {', '.join(differing)}"))
    return wrong


if __name__ == "__main__":
    main()
