"""Field files: what they say, the commented one, and what is refused with its line."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest

from geoprint.config import FIELD_EXAMPLE, FieldFile, job_of, read_curve, read_field, stored_field
from geoprint.errors import InputError, UsageError

WALL = """\
[wall]
volume = "heart.nii"
labels = [1, 7]
cavity = [11]
base = [3]
epicardial_deg = -60.0
endocardial_deg = 60.0
"""
RIM = "[[preferences]]\nrim = true\n"


def _written(folder: Path, text: str) -> Path:
    path = folder / "field.toml"
    path.write_text(text)
    return path


def test_the_commented_file_follows_the_rim_and_every_comment_in_it_is_a_table(tmp_path: Path) -> None:
    found = read_field(_written(tmp_path, FIELD_EXAMPLE))
    assert [(table.rim, table.weight) for table in found.preferences] == [(True, 100.0)]
    shown = re.sub(r"(?m)^# (?=\[|\w+ = )", "", FIELD_EXAMPLE)
    keys = tomllib.loads(shown)
    assert len(keys["preferences"]) == 4
    helix, wall, width = keys.pop("helix"), keys.pop("wall"), keys.pop("width")
    designed = FieldFile.model_validate(keys)
    assert {name for table in designed.preferences for name in table.model_fields_set} == {
        "rim", "direction", "curvature", "stroke", "weight"
    }  # fmt: skip
    assert designed.singularities[0].index == 1.0
    record = FieldFile.model_validate({"helix": helix}).helix
    assert record is not None
    assert record.angle == 30.0
    ventricle = FieldFile.model_validate({"wall": wall}).wall
    assert ventricle is not None
    assert (ventricle.labels, ventricle.cavity, ventricle.base) == ([1, 7], [11], [3, 5])
    for names in ({"table"}, {"direction", "begin_mm", "end_mm"}, {"places", "at_mm", "within_mm"}):
        chosen = {"preferences": [{"rim": True}], "width": {name: width.pop(name) for name in names}}
        recorded_width = FieldFile.model_validate(chosen).width
        assert recorded_width is not None
        assert recorded_width.model_fields_set == names
    assert width == {}
    assert designed.through is not None
    assert (designed.through.inner_deg, designed.through.outer_deg) == (60.0, -60.0)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", r"^field.toml: it defines no line: give a preference, a singularity, a helix or a wall; `geoprint init`"),
        ("[[preferences]]\nrim = true\nwait = 2\n", r"^field.toml, line 3: preferences.1.wait: there is no such key"),
        ("[[preferences]]\nweight = 2.0\n", r"line 1: preferences.1: a preference is one of rim, .* found none"),
        ("[[preferences]]\nrim = true\ncurvature = 'largest'\n", r"found rim and curvature"),
        ("[[preferences]]\ncurvature = 'mean'\n", r"line 2: .*'smallest' or 'largest', found 'mean'"),
        ("[[preferences]]\ndirection = [0.0, 0.0, 0.0]\n", r"a direction must have a length"),
        ("[[preferences]]\nrim = true\nweight = 0.0\n", r"line 3: .*greater than 0, found 0.0"),
        ("[[singularities]]\nplace = [0.0, 0.0, 0.0]\nindex = 0.3\n", r"line 3: .*multiple of 0.5, found 0.3"),
        ("[helix]\naxis = [0.0, 0.0, 0.0]\nangle = 10.0\n", r"line 1: helix: an axis must have a length"),
        ("[helix]\naxis = [0.0, 0.0, 1.0]\nangle = 91.0\n", r"line 3: helix.angle: .*at most 90, found 91.0"),
        (
            "[helix]\naxis = [0.0, 0.0, 1.0]\nangle = 9.0\n[[preferences]]\nrim = true\n",
            r"a helix defines every line: remove the preferences and singularities, or the helix",
        ),
        (f"{RIM}[through]\ninner_deg = 9.0\n", r"line 3: through: lines turn by turn_deg_per_mm, .* found inner_deg;"),
        (
            f"{RIM}[through]\nturn_deg_per_mm = 1.0\ninner_deg = 9.0\nouter_deg = 2.0\n",
            r"found turn_deg_per_mm and inner_deg and outer_deg",
        ),
        (f"{RIM}[through]\nturn_deg_per_mm = 999.0\n", r"line 4: .*at most 360, found 999.0"),
        (WALL.replace("cavity = [11]", "cavity = [7]"), r"line 1: wall: a label is of the wall, .* found 7 twice"),
        (WALL.replace("cavity = [11]", "cavity = []"), r"line 4: wall.cavity: .*at least 1 item"),
        (WALL.replace("base = [3]\n", ""), r"line 1: wall.base: this key is missing"),
        (WALL + RIM, r"a wall defines every line through it: remove all tables but the width, or the wall"),
        (WALL + "[through]\ninner_deg = 6.0\nouter_deg = 9.0\n", r"a wall defines every line through it"),
        (f"{RIM}[width]\n", r"line 3: width: a width is from a table, along a direction .* found none"),
        (
            f"{RIM}[width]\ntable = 'w.csv'\nat_mm = 1.0\n",
            r"about places with at_mm and within_mm, found table and at_mm",
        ),
        (f"{RIM}[width]\ndirection = [0.0, 0.0, 1.0]\nbegin_mm = 1.0\n", r"found direction and begin_mm"),
        (
            f"{RIM}[width]\ndirection = [0.0, 0.0, 0.0]\nbegin_mm = 1.0\nend_mm = 2.0\n",
            r"line 3: width: a direction must have a length",
        ),
        (f"{RIM}[width]\nplaces = []\nat_mm = 1.0\nwithin_mm = 3.0\n", r"line 4: width.places: .*at least 1 item"),
        (f"{RIM}[width]\nplaces = [[0.0, 0.0, 0.0]]\nat_mm = 0.0\nwithin_mm = 3.0\n", r"line 5: .*greater than 0"),
        (f"{RIM}[width]\ntable = 'w.csv'\n", r"^field.toml: \[width\] names the table w.csv, but the file"),
        (WALL, r"^field.toml: \[wall\] names the volume heart.nii, but the file .*heart.nii does not exist\.$"),
        ("rim = [\n", r"^field.toml is not valid TOML"),
    ],
)
def test_what_means_nothing_is_refused_with_its_line(text: str, sentence: str, tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=sentence):
        read_field(_written(tmp_path, text))


def test_a_file_that_is_not_there_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"the field file .*nowhere.toml cannot be read .*`geoprint init` writes one"):
        read_field(tmp_path / "nowhere.toml")


def test_the_volume_of_a_wall_is_named_from_the_folder_of_the_file(tmp_path: Path) -> None:
    (tmp_path / "heart.nii").write_bytes(b"labels")
    found = read_field(_written(tmp_path, WALL)).wall
    assert found is not None
    assert found.volume == str(tmp_path / "heart.nii")
    assert stored_field(tmp_path / "field.toml").files == {("wall", "volume"): ("heart.nii", b"labels")}
    (tmp_path / "w.csv").write_bytes(b"x,y,z,width")
    both = _written(tmp_path, f"{WALL}[width]\ntable = 'w.csv'\n")
    assert stored_field(both).files["width", "table"] == ("w.csv", b"x,y,z,width")
    assert len(stored_field(both).files) == 2
    assert (stored_field(_written(tmp_path, RIM)).text, stored_field(tmp_path / "field.toml").files) == (RIM, {})


def test_a_job_file_names_it_from_its_own_folder(tmp_path: Path) -> None:
    (tmp_path / "job.toml").write_text('surface = "part.ply"\nspacing = 1.0\npattern = "fibres"\nfield = "own.toml"\n')
    assert job_of(surface=tmp_path / "job.toml").field == tmp_path / "own.toml"


# Tables of a curve's points: what spreadsheets write is read, and what is wrong is named with its line.


POINTS = [[1.5, 2.0, -3.25], [4.0, 5.0, 6.0]]


@pytest.mark.parametrize(
    "text",
    [
        "x,y,z\n1.5,2,-3.25\n4,5,6\n",
        "1.5, 2, -3.25\n4, 5, 6\n",
        "1,5;2;-3,25\n4;5;6\n",
        "1,5 2 -3,25\n4   5 6",
        "x y z\n1.5 2 -3.25\n4 5 6\n",
        "1,5\t2\t-3,25\n4\t5\t6\n",
        "\ufeffX;Y;Z\r\n1,5;2;-3,25\r\n4;5;6\r\n",
        'sep=;\n"x";"y";"z"\n"1,5";"2";"-3,25"\n4;5;6\n',
        '"x","y","z"\n"1,5","2","-3,25"\n"4","5","6"\n',
        "# round the apex\nname;y [mm];x_mm;z (mm);note\na;2;1,5;-3,25;hello, you\n;;;\nb;5;4;6;\n",
        "id,Points:0,Points:1,Points:2\n7,1.5,2,-3.25\n8,4,5,6\n",
        "1.5,2,\N{MINUS SIGN}3.25\n4.,5,0.6e1,\n",
    ],
)
@pytest.mark.parametrize("encoding", ["utf-8", "utf-16"])
def test_a_table_is_read_as_spreadsheets_write_it(tmp_path: Path, text: str, encoding: str) -> None:
    (tmp_path / "c.csv").write_bytes(text.encode(encoding))
    assert read_curve(tmp_path / "c.csv") == POINTS


def test_names_in_any_character_set_do_no_harm(tmp_path: Path) -> None:
    (tmp_path / "c.csv").write_bytes("L\u00e4nge;x;y;z\n9;1,5;2;-3,25\n9;4;5;6\n".encode("latin-1"))
    assert read_curve(tmp_path / "c.csv") == POINTS


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("a;b\n1;2\n", "line 1: the first row must name the columns x,y,z, found 'a,b'"),
        ("x [cm],y,z\n1,2,3\n", r"line 1: column 'x \[cm\]' is in another unit \(cm\), it is read in mm"),
        ("x,y,z\n1,2\n", "line 2: found 2 cells separated by commas, but the header names 3"),
        (
            "1,5,2,5,3,5\n",
            "line 1: found 6 cells separated by commas and no header.* decimal commas need semicolons or tabs",
        ),
        ("# no\n1;2;3\n1;2;3;4\n", "line 3: found 4 cells separated by semicolons, but without a header there are 3"),
        ("x;y;z\n1.5;2;3\n1,5;2;3\n", "decimal points in line 2 and decimal commas in line 3"),
        ("x;y;z\n1.234,5;2;3\n", "without thousands separators"),
        ('x,y,z\n"1,234",2,3\n', "line 2: a comma before three digits may mark thousands or decimals"),
        ("x;y;z\n#REF!;2;3\n", "line 2, column x: found '#REF!', needed is a number of mm"),
        ("x;y;z\n1;two;3\n", "line 2, column y: found 'two'"),
        ("x,y,z\n1,nan,3\n", "line 2, column y: found 'nan'"),
        ("x,y,z\n1,2,1e9\n", "line 2, column z: found '1e9', needed is a number of mm between -1,000,000 and"),
        ('x,y,z\n"1,2,3\n', "line 2 cannot be read .* check its quotes"),
        ("# nothing\n\n", "c.csv is empty, as a table of points; its first row must name the columns, such as x,y,z"),
        ("x,y,z\n" + "1,2,3\n" * 10_001, "has more than 10000 rows, which is the most"),
        ("x,y,z\n" + "1,2,3\n" * 200_000, "has 1,200,006 bytes, a table of points has at most 1,000,000"),
    ],
)
def test_what_is_wrong_with_a_table_is_named_with_its_line(tmp_path: Path, text: str, sentence: str) -> None:
    (tmp_path / "c.csv").write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=sentence):
        read_curve(tmp_path / "c.csv")


def test_a_table_that_is_absent_or_a_folder_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"absent\.csv` cannot be read as a table of points"):
        read_curve(tmp_path / "absent.csv")
    with pytest.raises(InputError, match="no plain file"):
        read_curve(tmp_path)
