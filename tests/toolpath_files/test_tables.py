"""Tables of toolpaths as people have them: one path in many forms has equal runs, and what is unclear is refused."""

from __future__ import annotations

import random
from pathlib import Path

import numpy as np
import pytest

from geoprint.config import read_curve
from geoprint.errors import InputError
from geoprint.toolpath_files import PathFile, read_paths
from geoprint.workflow.number_tables import read_points, read_thicknesses
from tests.shared_data import shared

# Three straight runs of 10 mm, 4 mm apart.
RUNS = [[[0.5, 4.0 * i, 0.0], [10.5, 4.0 * i, 0.0]] for i in range(3)]


def runs(found: PathFile) -> list[list[list[float]]]:
    return [run.round(6).tolist() for run in np.split(found.curves.points, found.curves.offsets[1:-1])]


def read(folder: Path, text: str, *, encoding: str = "utf-8") -> PathFile:
    (folder / "p.csv").write_bytes(text.encode(encoding))
    return read_paths(folder / "p.csv")


def lines(*, separator: str = ",", run: bool = True, comma: bool = False) -> list[str]:
    rows = [
        [f"{x:g}", f"{y:g}", f"{z:g}", *([str(number)] if run else [])]
        for number, points in enumerate(RUNS, start=1)
        for x, y, z in points
    ]
    return [separator.join(cell.replace(".", ",") if comma else cell for cell in row) for row in rows]


BODY = "\n".join(lines())
BLANKS = "\n\n".join("\n".join(lines(run=False)[i : i + 2]) for i in (0, 2, 4))


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-16-be"])
@pytest.mark.parametrize(
    "text",
    [
        *(f"x,y,z,{name}\n{BODY}\n" for name in ("run", "path_id", "Path ID", "stroke", "polyline_id", "bead")),
        "x;y;z;run\n" + "\n".join(lines(separator=";", comma=True)),
        "x\ty\tz\trun\n" + "\n".join(lines(separator="\t", comma=True)),
        "x|y|z|run\n" + "\n".join(lines(separator="|")),
        "pos_x [mm] pos_y [mm] pos_z [mm]".replace(" [mm]", "_mm") + " run\n" + "\n".join(lines(separator=" ")),
        "# x,y,z,run\n" + BODY,
        "sep=;\n" + "x;y;z;run\n" + "\n".join(lines(separator=";")),
        f"x,y,z\n{BLANKS}\n",
        f"{BLANKS}\n\n\n",
        BLANKS.replace(",", " "),
        BLANKS.replace("\n\n", "\n,,\n"),
        BLANKS.replace("\n", "\r\n"),
        "x,y,z,run\n" + BODY.replace("\n", "\n\n"),
        '"x","y","z","run"\n' + "\n".join(",".join(f'"{cell}"' for cell in row.split(",")) for row in lines()),
    ],
)
def test_one_path_in_many_forms_has_equal_runs(tmp_path: Path, text: str, encoding: str) -> None:
    assert runs(read(tmp_path, text, encoding=encoding)) == RUNS


@pytest.mark.parametrize(
    ("column", "on", "off"),
    [
        ("deposit", "1", "0"), ("extruder_on", "True", "False"), ("is_printing", "yes", "no"), ("valve", "on", "off"),
        ("travel", "0", "1"), ("is_rapid", "false", "true"), ("dispense_on", "1.0", "0.0"),
    ],
)  # fmt: skip
def test_a_column_tells_deposit_from_travel(tmp_path: Path, column: str, on: str, off: str) -> None:
    rows = [f"{row},{on}" for row in lines(run=False)]
    between = f"99,99,9,{off}"
    text = "\n".join([f"x,y,z,{column}", between, *rows[:2], between, *rows[2:4], between, *rows[4:], between])
    found = read(tmp_path, text)
    assert (runs(found), found.deposit) == (RUNS, f"its column {column}")


def test_numbers_of_runs_may_begin_anew_in_each_layer(tmp_path: Path) -> None:
    rows = [f"{x},{y},{z},0,{number}" for number, points in enumerate(RUNS) for x, y, z in points]
    assert runs(read(tmp_path, "x,y,z,run,layer\n" + "\n".join(rows))) == RUNS


def test_what_is_not_used_is_named(tmp_path: Path) -> None:
    text = "x,y,z,path_id,qx,feed\n" + "\n".join(f"{row},0,20" for row in lines())
    found = read(tmp_path, f"# hand made\n{text}\n\n")
    assert found.reading.used == {"points": 6}
    assert dict(found.reading.skipped) == {"unused columns (qx, feed)": 2, "comments": 1, "blank rows": 1}
    assert found.reading.assumed == ("runs by the column path_id",)
    assert read(tmp_path, BLANKS).reading.assumed == (
        "columns x, y, z, as no header names them", "a run ends at each of 2 blank rows",
    )  # fmt: skip


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("1,2,3,4\n1,2,4,4\n", "line 1: found 4 cells separated by commas and no header; name the columns"),
        ("x,y,z\n1.5,2,3\n1,5;2;3\n", "line 3: found 2 cells"),
        ("x;y;z\n1.5;2;3\n1,5;2;3\n", "decimal points in line 2 and decimal commas in line 3"),
        ('x,y,z\n"1,234",2,3\n"2,345",2,3\n', "line 2: a comma before three digits may mark thousands"),
        ("x,y,z,extruder_on\n1,2,3,0.4\n", "line 2: column extruder_on is '0.4', needed is 0 or 1"),
        ("x_cm,y,z\n1,2,3\n2,2,3\n", r"line 1: column 'x_cm' is in another unit \(cm\)"),
        ("x,y,z,path_id\n1,2,3,\n", "line 2: the cell of column path_id is empty"),
    ],
)
def test_what_is_unclear_is_refused_with_its_line(tmp_path: Path, text: str, complaint: str) -> None:
    with pytest.raises(InputError, match=complaint):
        read(tmp_path, text)


def mutated(generator: random.Random) -> str:
    """Return the runs in one of the equivalent forms, at random."""
    separator = generator.choice([",", ";", "\t", " ", "|"])
    comma = separator != "," and generator.random() < 0.5
    names = ["x", "y", "z", generator.choice(["run", "path_id", "Stroke", "toolpath"])]
    order = generator.sample(range(4), 4)
    more = generator.choice([[], ["feed"], ["time", "note"]])
    end = generator.choice(["\n", "\r\n", "\r"])
    if generator.random() < 0.5:
        names[:3] = [generator.choice(["{}_mm", "{}[mm]", "POS_{}", "{}(mm)"]).format(axis) for axis in "xyz"]
    rows = [separator.join([*(names[place] for place in order), *more])]
    for row in lines():
        cells = row.split(",")
        if generator.random() < 0.3:
            cells[0] = f"{float(cells[0]):.5e}"
        cells = [*(cells[place] for place in order), *("7" for _ in more)]
        cells = [cell.replace(".", ",") if comma else cell for cell in cells]
        quoted = generator.random() < 0.3
        rows.append(separator.join(f'"{cell}"' if quoted else cell for cell in cells))
        if generator.random() < 0.2:
            rows.append(generator.choice(["# said", "", separator * 3]))
    return end.join(rows) + generator.choice(["", end, end * 3])


def test_five_hundred_equivalent_forms_have_equal_runs(tmp_path: Path) -> None:
    generator = random.Random(51)  # noqa: S311  # Nothing is kept secret.
    for _ in range(500):
        text = mutated(generator)
        encoding = generator.choice(["utf-8", "utf-8-sig", "utf-16"])
        assert runs(read(tmp_path, text, encoding=encoding)) == RUNS, text


def test_the_tables_of_the_field_are_read() -> None:
    found = read_paths(shared("field/k12_path_id.csv"))
    lengths = [
        float(np.linalg.norm(run[1] - run[0])) for run in np.split(found.curves.points, found.curves.offsets[1:-1])
    ]
    assert lengths == [56.0] * 10
    assert dict(found.reading.skipped)["unused columns (qx, qy, qz, qw)"] == 4
    assert read_curve(shared("field/curve.csv")) == [[0.5, 1.0, 0.0], [1.5, 1.0, 0.0]]
    places, values = read_thicknesses(shared("field/thick.csv"))
    assert (places.tolist(), values.tolist()) == ([[0.5, 1.0, 0.0], [1.5, 1.0, 0.0]], [1.0, 1.0])


def test_small_tables_take_their_columns_in_any_order_and_among_others(tmp_path: Path) -> None:
    (tmp_path / "p.csv").write_bytes("note;Z;Name;Y;X\nhello, you;3,5;a;2;1\n".encode("utf-16"))
    found = read_points(tmp_path / "p.csv")
    assert (found.names, found.places.tolist()) == (("a",), [[1.0, 2.0, 3.5]])
    assert found.reading.skipped == {"unused columns (note)": 1}


def test_columns_of_a_small_table_that_are_not_used_are_named(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    (tmp_path / "curve.csv").write_text("x,y,speed,z,no\x07te\n1,2,9,3,a\n4,5,9,6,b\n", encoding="utf-8")
    assert read_curve(tmp_path / "curve.csv") == [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]
    assert caplog.messages == ["note: curve.csv: skipped: unused columns (speed, no?te); used: x, y, z."]
