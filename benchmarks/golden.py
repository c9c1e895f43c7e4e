"""Does geoprint still write the same, byte for byte? Results of every kind, held against their recorded hashes.

    python -m benchmarks.golden [--cases NAME ...] [--keep DIR] [--record]

Made with the command line, so that nothing inside geoprint is asked. Of every RAPID module, CSV and JSON file the hash
is compared with `tests/golden/hashes.json`; `timings.json` alone differs from run to run. The last bits of a number
depend on the machine's processor and linear algebra, and some decisions on these: the hashes hold on machines of the
kind that recorded them, so before a change that shall leave everything as it is, record them on your own with
`--record`. What holds on every machine (`stable`) stands in `tests/golden/stable.json`, which `tests/test_golden.py`
compares.
"""

from __future__ import annotations

import hashlib
import json
import re
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import cast

from benchmarks import ROOT
from benchmarks.parts.tables import script_parser

GOLDEN = ROOT / "tests" / "golden"
HASHES, STABLE = GOLDEN / "hashes.json", GOLDEN / "stable.json"
# What RAPID, tables and figures are written in; pictures and pages are looked at instead.
SUFFIXES = {".mod", ".pgf", ".csv", ".json"}
# Seconds differ from run to run; manifest.json has the hash of every file, pictures and meshes among them.
UNSTEADY = {"timings.json", "manifest.json"}
DEMO = ("--unit", "mm", "--place", "demo")
# Cells that come with geoprint, as `geoprint init` writes them.
STRAIGHT, TILTING = "irb120-straight160.toml", "irb120-tilting45.toml"
# Lists of JSON whose length no rounding decides.
STEADY_LISTS = {"files", "layers", "parts", "patches", "photographs", "planned", "robot"}
# Figures of JSON that decisions on rounding hardly change.
FIGURES = {
    "area_mm2", "cv", "deposit_mm", "gap", "judged", "laid_mm3", "largest_deg", "length_mm", "levels", "mean",
    "mean_mm", "overlap", "runs", "travel_mm", "volume_mm3", "wanted_mm3", "width_cv", "width_mean_mm",
}  # fmt: skip
# The small bundle: a disc of 4 mm about the middle of the plate.
SMALL = ("plan", "data/plate.ply", *DEMO, "--at", "0", "0", "0", "--radius", "4", "--spacing", "2")
# Stands for the case's folder, in cases of several commands; a single one writes the folder itself.
HERE = "{}"
# Name to command line, or to several of them.
CASES: dict[str, tuple[str, ...] | tuple[tuple[str, ...], ...]] = {
    "small": SMALL,
    "plate": ("compare", "data/plate.ply", *DEMO, "--spacing", "6", "--backend", "all", "--samples"),
    "apex-marching": (
        "plan", "data/heart_apex_patch.ply", *DEMO, "--spacing", "2", "--body", "data/heart.ply",
        "--backend", "fast-marching",
    ),
    "apex-upright": ("plan", "data/heart_apex_patch.ply", *DEMO, "--spacing", "4", "--set", "max_tilt=0"),
    "flat-lscm": (
        "plan", "data/heart_flat_patch.ply", *DEMO, "--spacing", "3", "--backend", "lscm",
        "--set", "options.lscm.resolution=300",
    ),
    "flat-heat": (
        "plan", "data/heart_flat_patch.ply", *DEMO, "--spacing", "2", "--set", "on_slowdown=follow",
        "--set", "accept_flow=true",
    ),
    "analog": ("plan", "data/plate.ply", "--unit", "mm", "--spacing", "3", "--cell", "tests/golden/analog.toml"),
    "straight": ("plan", "data/plate.ply", *DEMO, "--rounds", "4", "--cell", STRAIGHT),
    "paper": ("plan", "data/heart_flat_patch.ply", *DEMO, "--cell", "data/paper_case_a.toml"),
    "seed-lscm": (
        "plan", "data/heart_flat_patch.ply", *DEMO, "--spacing", "3", "--backend", "lscm",
        "--from", "point:41.7,4.6,-5.9",
    ),
    "two-patches": ("compare", "tests/golden/two_patches.toml"),
    "paths": (
        "compare", "data/heart_apex_patch.ply", "data/plate.ply", "--unit", "mm", "--spacing", "5", "--no-robot",
        "--backend", "all",
    ),
    "layers": (
        "plan", "data/plate.ply", *DEMO, "--at", "0", "0", "0", "--radius", "6", "--spacing", "4", "--thickness", "1",
    ),
    "spiral": (
        "plan", "data/plate.ply", *DEMO, "--at", "0", "0", "0", "--radius", "8", "--spacing", "2",
        "--pattern", "spiral",
    ),
    "guided": (
        "compare", "data/heart_flat_patch.ply", "--unit", "mm", "--spacing", "4", "--no-robot", "--pattern", "guided",
        "--from", "angle:30",
    ),
    "fibres": (
        "plan", "data/heart_apex_patch.ply", "--unit", "mm", "--spacing", "3", "--no-robot", "--pattern", "fibres",
        "--field", "tests/golden/helix.toml",
    ),
    "table-once": ("plan", "data/plate.ply", *DEMO, "--spacing", "8", "--cell", TILTING),
    "table": ("plan", "data/heart_apex_patch.ply", *DEMO, "--spacing", "9", "--cell", TILTING),
    "measure": (
        ("plan", "data/plate.ply", "--unit", "mm", "--spacing", "5", "--no-robot", "--out", f"{HERE}/ours"),
        (
            "measure", f"{HERE}/ours", "tests/golden/rows.csv", "--part", "data/plate.ply", "--unit", "mm",
            "--spacing", "5", "--out", f"{HERE}/measured",
        ),
    ),
    "simulate": (
        (*SMALL, "--out", f"{HERE}/planned"),
        ("simulate", f"{HERE}/planned", "--spread", "0.2", "--out", f"{HERE}/simulated"),
        (
            "appraise", f"{HERE}/simulated/print.png", "--plan", f"{HERE}/planned",
            "--fiducials", f"{HERE}/simulated/marks.csv", "--lens", f"{HERE}/simulated/lens.toml",
            "--out", f"{HERE}/appraised",
        ),
    ),
}  # fmt: skip


def main() -> None:
    """Plan the cases and compare or record their hashes; ends with 1 where one differs."""
    parser = script_parser(__doc__, smoke="the small bundle only, without comparing")
    parser.add_argument("--cases", nargs="+", choices=CASES, default=list(CASES), help="only these")
    parser.add_argument("--keep", type=Path, help="leave the bundles in this new folder, to look for what differs")
    parser.add_argument("--record", action="store_true", help="record the hashes and what holds on every machine")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        folder = arguments.keep or Path(temporary)
        folder.mkdir(exist_ok=True)
        names = ["small"] if arguments.smoke else arguments.cases
        folders = {name: planned(name, folder / name) for name in names}
        found = {name: hashes(folder) for name, folder in folders.items()}
        if arguments.record:
            _record(HASHES, found)
            _record(STABLE, {name: stable(folder) for name, folder in folders.items()})
            print(f"recorded {sum(map(len, found.values()))} files of {len(found)} cases")
        elif not arguments.smoke:
            sys.exit(_report(found))


def planned(name: str, folder: Path, *, run: Callable[[list[str]], int] | None = None) -> Path:
    """Run a case into a folder that does not exist yet, as a user would; return the folder.

    Args:
        name: of the case.
        folder: where its results go.
        run: runs a command of geoprint and returns its status; if None, each runs in a process of its own.
    """
    asked = CASES[name]
    commands = asked if isinstance(asked[0], tuple) else ((*asked, "--out", HERE),)
    with tempfile.TemporaryDirectory() as cells:
        if any(cell in command for command in commands for cell in (STRAIGHT, TILTING)):
            _geoprint(["init", cells])
        if len(commands) > 1:
            folder.mkdir()
        for command in commands:
            words = (str(Path(cells, word)) if word in {STRAIGHT, TILTING} else word for word in map(str, command))
            said = [word.replace(HERE, str(folder)) for word in words]
            if (run or _geoprint)(said):
                message = f"geoprint {' '.join(said)} failed"
                raise RuntimeError(message)
    return folder


def hashes(folder: Path) -> dict[str, str]:
    """Return the SHA-256 of each program, table and JSON file of a bundle, by its name there."""
    return {
        path.relative_to(folder).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(folder.rglob("*"))
        if path.suffix in SUFFIXES and path.name not in UNSTEADY
    }


def stable(folder: Path) -> dict[str, dict[str, object]]:
    """Return of each program, table and JSON file of a result what no rounding decides.

    Of a table its columns; of a module its declarations and which instructions it has; of JSON its keys, outside of
    lists that are longer or shorter by rounding, and the figures that hold on every machine.
    """
    found: dict[str, dict[str, object]] = {}
    for path in sorted(each for each in folder.rglob("*") if each.suffix in SUFFIXES and each.name not in UNSTEADY):
        text = path.read_text(encoding="utf-8")
        if path.suffix == ".csv":
            seen: dict[str, object] = {"columns": text.partition("\n")[0]}
        elif path.suffix == ".json":
            leaves = dict(_leaves(json.loads(text)))
            keys = {re.sub(r"\d+", "#", key) for key in leaves}
            figures = {key: value for key, value in leaves.items() if _is_figure(key, value)}
            seen = {"keys": sorted(keys), "figures": figures}
        else:
            declared = re.findall(r"^\s*((?:LOCAL )?(?:MODULE|PROC|FUNC|TRAP)\b[^(!\n]*)", text, re.MULTILINE)
            # The name of an attitude ends in a number of what it prints.
            declared = [re.sub(r"_\d+", "_#", line) for line in declared]
            words = set(re.findall(r"^\s*(\w+)(?=[\s;\\])", text, re.MULTILINE))
            seen = {"declared": declared, "instructions": sorted(words)}
        found[path.relative_to(folder).as_posix()] = seen
    return found


def _leaves(value: object, key: str = "") -> Iterator[tuple[str, object]]:
    """Yield key and value of what JSON holds, outside of lists that rounding may lengthen."""
    if isinstance(value, dict):
        for name, each in cast("dict[str, object]", value).items():
            yield from _leaves(each, f"{key}.{name}" if key else name)
    elif isinstance(value, list):
        if key.rpartition(".")[2] in STEADY_LISTS:
            for number, each in enumerate(cast("list[object]", value)):
                yield from _leaves(each, f"{key}[{number}]")
    else:
        yield key, value


def _is_figure(key: str, value: object) -> bool:
    number = isinstance(value, int | float) and not isinstance(value, bool)
    return number and key.rpartition(".")[2] in FIGURES


def _geoprint(arguments: list[str]) -> int:
    command = [sys.executable, "-m", "geoprint", *arguments]
    done = subprocess.run(command, cwd=ROOT, check=False, capture_output=True, text=True)  # noqa: S603
    if done.returncode:
        print(done.stderr, file=sys.stderr)
    return done.returncode


def _record(path: Path, found: Mapping[str, object]) -> None:
    known: dict[str, object] = json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}
    every = {**known, **found}
    kept = {name: every[name] for name in CASES if name in every}
    path.write_text(json.dumps(kept, indent=1) + "\n", encoding="utf-8")


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
