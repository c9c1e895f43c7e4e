"""What a newcomer meets: one message for each mistake, help that fits the screen, results that can be piped."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import nibabel
import numpy as np
import pytest

from geoprint.cli import terminal
from geoprint.cli.application import COMMANDS, PANELS
from geoprint.features import features
from geoprint.geometry.files import save_ply
from tests.commands import called
from tests.meshes import plate, sphere

GEOPRINT = [sys.executable, "-m", "geoprint"]

# The newcomer's mistakes: what is typed, the exit status, and the message to the letter.


def closed_ball(folder: Path) -> None:
    save_ply(sphere(radius=20.0), folder / "heart.ply")


def label_volume(folder: Path) -> None:
    volume = np.zeros((12, 12, 12), dtype=np.uint8)
    volume[2:5, 3:9, 3:9], volume[6:10, 3:9, 3:9] = 1, 2
    (folder / "labels.nii").write_bytes(nibabel.Nifti1Image(volume, np.diag([2.0, 2.0, 2.0, 1.0])).to_bytes())


def foreign_folder(folder: Path) -> None:
    (folder / "mine").mkdir()
    (folder / "mine" / "notes.txt").write_text("mine")


SPANS = (
    "`plate.ply` has no unit; it spans 40 x 30 x 0: 40 mm as mm, 40 m as m, 1.02 m as in, 400 mm as cm, 40 um as um."
)
ROUNDS = "10 rounds are about 1.5 mm apart on this part, 20 about 0.75 mm."
NOT_CALIBRATED = (
    "The cell irb120-bent45.toml is not calibrated: `--place demo` runs only dry, `--no-robot` plans paths alone."
)
NEWCOMER: list[tuple[str, int, str]] = [
    (
        "compare plate.ply --spacing 2 --place demo --out new",
        2,
        f"`--unit` is missing. {SPANS} Add `--unit mm`, for example.",
    ),
    (
        "compare plate.ply --unit mm --place demo --out new",
        2,
        f"`--spacing` is missing. {ROUNDS} Add `--spacing 1.5`, for example.",
    ),
    (
        "compare plate.ply --unit mm --spacing 2 --place demo",
        2,
        "`--out` is missing. Add `--out plate-compare`, for example.",
    ),
    (
        "compare plate.ply",
        2,
        (
            f"`--unit`, `--spacing`, `--place` and `--out` are missing. {SPANS} {ROUNDS} {NOT_CALIBRATED} "
            "Add `--unit mm --spacing 1.5 --place demo --out plate-compare`, for example."
        ),
    ),
    (
        "compare heart.ply --unit mm --spacing 4 --place demo",
        3,
        "heart.ply is closed and has no rim to start from; give a point on it with `--from point:X,Y,Z`.",
    ),
    (
        "plan plate.ply --unit mm --spacing 1mm --out new",
        2,
        "`--spacing` takes a number in mm, found '1mm': write `--spacing 1`.",
    ),
    ("plan plate.ply --unit mm --spacing -1 --out new", 2, "`--spacing`: it must be at least 0.001, found -1.0; "),
    (
        "plan plate.ply --unit inch --spacing 1 --out new",
        2,
        "`--unit`: it must be 'mm', 'cm', 'm', 'um' or 'in', found 'inch'; ",
    ),
    (
        "plan plate.ply --unit mm --spacing 2 --backend geodesic --place demo --out new",
        2,
        "there is no backend named 'geodesic'; choose one of: heat, fast-marching, lscm.",
    ),
    (
        "plan plate.ply --unit mm --spacing 2 --pattern zigzag --place demo --out new",
        2,
        "there is no pattern named 'zigzag'; choose one of: contours, spiral, guided, fibres.",
    ),
    ("slice plate.ply", 2, "there is no command `slice`: `geoprint plan PART` plans the paths of a part."),
    ("plan plate.ply --unit mm --spacing 2 --no-robot --out mine", 2, "mine holds notes.txt, which geoprint did not "),
    (
        "plan nowhere.ply --unit mm --spacing 2 --out new",
        3,
        "there is no file `nowhere.ply`; check its name and folder.",
    ),
    (
        "plan plate.ply --unit mm --spacing 2 --cell nowhere.toml --out new",
        2,
        "the cell file nowhere.toml does not exist; `geoprint init` writes one.",
    ),
    (
        "plan labels.nii --spacing 2 --place demo --out new",
        2,
        "`labels.nii` holds the labels 1 (108 voxels), 2 (144 voxels); choose one with `--label N`.",
    ),
    (
        "plan plate.ply --unit mm --spacing 2 --robot ur5e --place demo --out new",
        2,
        (
            "`geoprint plan` has no option `--robot`: the cell file names the arm; give it with `--cell FILE`, and "
            "`geoprint init` writes those of an irb120."
        ),
    ),
    ("guide calibration", 2, "the guide has no page `calibration`; did you mean `geoprint guide calibrate`?"),
    (
        "measure paths.csv --unit mm --spacing 2",
        2,
        (
            "`geoprint measure` needs `--part FILE`: mesh of the part that they cover; `geoprint measure --help` lists "
            "what it takes."
        ),
    ),
    # What was meant by other words, and by options as they once were.
    ("view plate.ply", 2, "`plate.ply` has no unit; it spans 40 x 30 x 0: 40 mm as mm,"),
    ("plate.ply --unit mm", 2, "there is no command `plate.ply`: for a part, `geoprint compare plate.ply` compares"),
    ("cmpare plate.ply", 2, "there is no command `cmpare`; did you mean `geoprint compare`?"),
    ("compare plate.ply --backends heat", 2, "`geoprint compare` has no option `--backends`: write `--backend`, with "),
    ("plan plate.ply --patterns contours", 2, "`geoprint plan` has no option `--patterns`: write `--pattern`, with "),
    ("plan plate.ply --step 0.05", 2, "`geoprint plan` has no option `--step`: write `--rounds`, which is 20 for a st"),
    ("plan plate.ply --resolution 9", 2, "`geoprint plan` has no option `--resolution`: write `--set options.lscm.res"),
    ("plan plate.ply --option a.b=1", 2, "`geoprint plan` has no option `--option`: write `--set options.NAME.KEY="),
    ("plan plate.ply --max-tilt 3", 2, "`geoprint plan` has no option `--max-tilt`: write `--set max_tilt=VALUE`."),
    ("place plate.ply --cone 3", 2, "`geoprint place` has no option `--cone`: write `--set patches.1.cone_deg=VALUE`."),
]


@pytest.fixture(scope="module")
def newcomer(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder as a newcomer has it."""
    made = tmp_path_factory.mktemp("newcomer")
    save_ply(plate((40.0, 30.0), (20, 15), jitter_seed=1), made / "plate.ply")
    closed_ball(made)
    label_volume(made)
    foreign_folder(made)
    return made


@pytest.mark.parametrize(("line", "status", "message"), NEWCOMER)
def test_a_newcomers_mistake_ends_in_one_message_that_names_the_next_step(
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    newcomer: Path,
    *,
    line: str,
    status: int,
    message: str,
) -> None:
    monkeypatch.setattr("geoprint.cli.planning.PROCESSES", 1)
    before = sorted(newcomer.rglob("*"))
    monkeypatch.chdir(newcomer)
    assert called(monkeypatch, *line.split()) == status
    printed = capsys.readouterr()
    assert printed.out == ""
    assert printed.err.replace(f"{newcomer}/", "").startswith(f"geoprint: {message}")
    assert printed.err.count("\n") == 1
    # Nothing that a machine would say.
    words = ("Traceback", "Errno", "Input should", "None", "Error", "click", "pydantic", "valid float")
    assert not [word for word in words if word in printed.err]
    assert sorted(newcomer.rglob("*")) == before


# Help, and where results go.


# Of `plan` 43, of `compare` 45 and of `place` 40 before rare ones moved to the job file, with -h.
MOST_OPTIONS = {"plan": 28, "compare": 30, "place": 24, "measure": 16}
NAMES = [name for _, commands in COMMANDS.items() for name in commands] + [
    name for feature in features() for name in feature.commands
]
OPTION = re.compile(r"(?m)^  (?:-\w, )?(--[\w-]+)(?: (\S+(?: [A-Z])*))?(?:  |$)")
FORM = re.compile(r"[A-Z][A-Z0-9/]*( N|x[A-Z]|=[A-Z]+|,\.\.\.)?|(X Y Z ?)+|[a-z-]+(\|[a-z-]+)+")


@pytest.mark.parametrize("command", NAMES)
def test_help_has_few_options_in_panels_and_metavars_of_one_form(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], command: str
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    assert called(monkeypatch, command, "--help") == 0
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines)) <= 80
    options = OPTION.findall("\n".join(lines))
    assert len({name for name, _ in options}) == len(options) <= MOST_OPTIONS.get(command, 21)
    assert not [shape for _, shape in options if shape and not FORM.fullmatch(shape)]
    panels = [line.rstrip(":") for line in lines if re.fullmatch(r"[A-Z]\w+:", line)]
    assert panels == [panel for panel in PANELS if panel in panels]


def test_results_go_to_stdout_and_notes_to_stderr(capsys: pytest.CaptureFixture[str]) -> None:
    text = "thickness 2 %\nnote: one\nwarning: two\nlength 3\nnot checked: four"
    terminal.result(text, lambda: {"a": 1}, as_json=False)
    printed = capsys.readouterr()
    assert printed.out == "thickness 2 %\nlength 3\n"
    assert printed.err == "note: one\nwarning: two\nnot checked: four\n"
    terminal.result(text, lambda: {"a": 1}, as_json=True)
    again = capsys.readouterr()
    assert json.loads(again.out) == {"a": 1}
    assert again.err == printed.err


def test_results_fit_the_columns_that_are_asked_for_also_through_a_pipe() -> None:
    asked = [*GEOPRINT, "inspect", "data/plate.ply"]
    wide, narrow = (
        subprocess.run(asked, capture_output=True, text=True, check=True, env=os.environ | {"COLUMNS": columns}).stdout
        for columns in ("200", "60")
    )
    assert max(map(len, wide.splitlines())) > 60
    assert max(map(len, narrow.splitlines())) <= 60
    assert wide.split() == narrow.split()
