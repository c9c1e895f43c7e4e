"""Tables of a curve's points: what spreadsheets write is read, and what is wrong is named with its line."""

from __future__ import annotations

from pathlib import Path

import pytest

from geoprint.config import read_curve
from geoprint.errors import InputError

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
        ("x,y,z\n1,2\n", "line 2: found 2 cells parted by commas, but the header names 3"),
        (
            "1,5,2,5,3,5\n",
            "line 1: found 6 cells parted by commas and no header.* decimal commas need semicolons or tabs",
        ),
        ("# no\n1;2;3\n1;2;3;4\n", "line 3: found 4 cells parted by semicolons, but without a header there are 3"),
        ("x;y;z\n1.5;2;3\n1,5;2;3\n", "decimal points in line 2 and decimal commas in line 3"),
        ("x;y;z\n1.234,5;2;3\n", "without marks between thousands"),
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
