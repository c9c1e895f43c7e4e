"""What people read is plain: short sentences, one negation, no machine text, singular for one."""

from __future__ import annotations

import pytest

from benchmarks.messages import RULES, faults, sentences, texts, texts_of
from geoprint.errors import how_many, percent, reason_of
from geoprint.reporting.records.rounding import listed

LONG = "the part " + "and the body " * 9 + "lie apart."


def test_all_texts_of_the_package_are_plain() -> None:
    read = list(texts())
    assert len(read) > 2000
    assert [f"{text.path}:{text.line}: {said}{text.words}" for text in read for said in faults(text)] == []


@pytest.mark.parametrize(
    ("rule", "source"),
    [
        ("words", f"raise InputError('{LONG}')"),
        ("words", f"raise InputError(f'{{name}}: {LONG}')"),
        ("negation", "raise InputError('no program is written without a part.')"),
        ("negation", "raise InputError('the plan cannot be made with nothing to print.')"),
        ("pydantic", "raise InputError('Field required in the job file.')"),
        ("pydantic", "try: read()\nexcept ValidationError as error: raise InputError(f'the job is wrong: {error}.')"),
        ("errno", "try: read()\nexcept OSError as error: raise InputError(f'the file cannot be read ({error}).')"),
        (
            "errno",
            "try: read()\nexcept (ValueError, OSError) as no: raise InputError(f'it cannot be read: {str(no)}.')",
        ),
        ("class", "raise InputError('the PoseStream must not be empty.')"),
        ("class", "raise InputError(f'the value is a {type(value).__name__} here.')"),
        ("none", "raise InputError('the spacing must be None here.')"),
        ("retired", "yield 'material is laid twice along the rim.'"),
        ("percent", "yield 'it covers 5% of the area.'"),
        ("percent", "yield f'it covers {share:.1%} of the area.'"),
        ("percent", "yield f'{share:.{digits}%}'"),
        ("count", "yield f'the plan has {len(runs)} runs in all.'"),
        ("count", "yield f'left out at the rim: {poses.count} short runs.'"),
    ],
)
def test_a_planted_sentence_is_found(rule: str, source: str) -> None:
    (text,) = texts_of(source)
    assert list(faults(text)) == [f"{RULES[rule]}: "]


@pytest.mark.parametrize(
    "source",
    [
        # Two sentences, each short enough; alternatives of which each is; a point and a command count as a word.
        f"raise InputError('{LONG[: len(LONG) // 2]}. Then {LONG[len(LONG) // 2 :]}')",
        "yield f\"the part lies {'in front of the arm' if a else 'behind it'} and so on to the end\"",
        "yield f'the tip at ({x}, {y}, {z}) mm is out of reach: use `geoprint place part.ply --unit mm`.'",
        # A negation each in two clauses.
        "raise InputError('the part has no rim, so give no source.')",
        "try: read()\nexcept OSError as error: raise InputError(f'the file cannot be read ({reason_of(error)}).')",
        "yield f'the plan has {how_many(len(runs), 'run')} in all.'".replace("'run'", '"run"'),
        "yield f'it takes {seconds} seconds of the time.'",
        "yield f'it covers {percent(share, 1)} of the area, 5 % of it twice.'",
    ],
)
def test_a_plain_sentence_is_not_found(source: str) -> None:
    assert [said for text in texts_of(source) for said in faults(text)] == []


def test_code_is_no_text() -> None:
    source = (
        '"""Return the words of a text here."""\nNAMES = "one or two names".split()\nx: "dict[str, int] | None" = 0\n'
    )
    assert list(texts_of(source)) == []


def test_a_text_is_read_with_what_it_puts_in() -> None:
    source = "yield f\"{name}: {'all' if whole else 'some'} of the runs \" + f'are {n:.3g} mm long. Print them.'"
    (text,) = texts_of(source)
    assert text.words == "{name}: [all|some] of the runs are {n} mm long. Print them."
    assert sentences(text.words) == ["{name}: [all|some] of the runs are {n} mm long", "Print them."[:-1]]


def test_one_is_singular() -> None:
    assert [how_many(count, "run") for count in (0, 1, 2)] == ["0 runs", "1 run", "2 runs"]
    assert [how_many(count, "vertex", "vertices") for count in (1, 2)] == ["1 vertex", "2 vertices"]
    assert listed(["lscm"]) == "lscm"


def test_a_share_is_in_per_cent_behind_a_space() -> None:
    assert [percent(share) for share in (0.0, 0.256, 1.0)] == ["0 %", "26 %", "100 %"]
    assert percent(0.00456, 2) == "0.46 %"
    assert [percent(share, 1, signed=True) for share in (0.031, -0.2)] == ["+3.1 %", "-20.0 %"]


def test_an_error_of_the_system_is_named_without_its_number() -> None:
    assert reason_of(FileNotFoundError(2, "No such file or directory", "job.toml")) == "No such file or directory"
    assert reason_of(OSError("cut short")) == reason_of(ValueError("cut short")) == "cut short"
