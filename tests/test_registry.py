"""What is known by name: built in, registered, named by entry points; and the options that constructors take."""

from __future__ import annotations

import importlib
import sys
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

import pytest

from geoprint.errors import UsageError
from geoprint.registry import Factory, Registry
from tests.installed import installed

if TYPE_CHECKING:
    # Not there when the program runs, as many packages import what only their annotations need.
    from fractions import Fraction

GROUP = "geoprint.trials"
MODULE = """
class Guest:
    title = "a guest"
    def work(self): ...

class Idler:
    title = "without work"

def function(): ...
"""


class Worker:
    title: ClassVar[str] = "works"

    def __init__(
        self, place: str, *, count: int | None = None, share: float = 0.5, fast: bool = False, word: str = ""
    ) -> None:
        self.said = (place, count, share, fast, word)

    def work(self) -> None: ...


class Eager:
    title: ClassVar[str] = "needs to know how often"
    summary: ClassVar[object] = "Works as often as it is told."

    def __init__(self, *, times: int) -> None: ...

    def work(self) -> None: ...


class Odd:
    title: ClassVar[str] = "has odd facts"
    summary: ClassVar[object] = 3

    def __init__(self, *, shape: Fraction | None = None) -> None: ...

    def work(self) -> None: ...


@pytest.fixture
def registry() -> Registry[Factory[object]]:
    return Registry("trial", group=GROUP, built_in={"worker": Worker, "eager": Eager}, members=("title", "work"))


@pytest.fixture
def guests(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a folder on the path in which packages can be installed."""
    (tmp_path / "guests_of_a_test.py").write_text(MODULE)
    monkeypatch.setattr(sys, "path", [str(tmp_path), *sys.path])
    importlib.invalidate_caches()
    return tmp_path


def install(folder: Path, name: str, **points: str) -> None:
    named = {point: f"guests_of_a_test:{value}" for point, value in points.items()}
    installed(folder, name=name, version="2.0", groups={GROUP: named})


def test_names_come_from_geoprint_then_from_scripts_then_from_packages(
    registry: Registry[Factory[object]], guests: Path
) -> None:
    install(guests, "visitors", zoe="Guest", guest="Guest")
    registry.register("mine", Worker)
    assert registry.names == ("worker", "eager", "mine", "guest", "zoe")
    assert registry.find("guest").factory.title == "a guest"
    assert registry.find("guest").summary == "a guest"
    assert registry.find("eager").summary == "Works as often as it is told."
    assert [entry.name for entry in registry.own] == ["worker", "eager", "mine"]


def test_an_unknown_name_is_refused_with_all_that_can_be_chosen(
    registry: Registry[Factory[object]], guests: Path
) -> None:
    install(guests, "visitors", guest="Guest")
    with pytest.raises(UsageError, match="no trial named 'workr'; choose one of: worker, eager, guest"):
        registry.find("workr")


@pytest.mark.parametrize(
    ("point", "sentence"),
    [
        ("no_such_thing", r"package visitors 2.0 \(entry point guest = .*:no_such_thing\) cannot be loaded"),
        ("Idler", "its class lacks work; a trial is a class with title, work"),
        ("function", "it is <function"),
    ],
)
def test_an_entry_point_that_is_broken_is_named_with_its_package(
    registry: Registry[Factory[object]], guests: Path, point: str, sentence: str
) -> None:
    install(guests, "visitors", guest=point)
    assert "guest" in registry.names
    with pytest.raises(UsageError, match=sentence):
        registry.find("guest")
    assert registry.find("worker").factory is Worker


def test_a_name_that_two_claim_is_refused_with_both(registry: Registry[Factory[object]], guests: Path) -> None:
    install(guests, "visitors", guest="Guest", worker="Guest")
    install(guests, "others", guest="Guest")
    with pytest.raises(UsageError, match=r"more than once, by the package (visitors|others) .* and the package"):
        registry.find("guest")
    with pytest.raises(UsageError, match=r"'worker' is named more than once, by geoprint itself and the package visit"):
        registry.find("worker")


@pytest.mark.parametrize("name", ["worker", "all", "Two", "a.b", "a,b", ""])
def test_a_name_that_is_taken_or_none_cannot_be_registered(registry: Registry[Factory[object]], name: str) -> None:
    with pytest.raises(UsageError, match=r"choose another name|needs a name"):
        registry.register(name, Worker)


def test_options_are_the_keyword_only_arguments_of_the_constructor(registry: Registry[Factory[object]]) -> None:
    entry = registry.find("worker")
    assert entry.options == ("count", "share", "fast", "word")
    given = {"count": 3, "share": 1, "fast": True, "word": "x"}
    assert entry.checked(given) == given
    assert entry.checked({}) == {}


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"cuont": 3}, r"worker has no option 'cuont'; it takes count \(int \| None\), share \(float\)"),
        ({"count": "many"}, r"`worker.count`: .*valid integer, found 'many'"),
        ({"count": 2.5}, "`worker.count`"),
        ({"share": float("nan")}, "`worker.share`.*finite"),
        ({"fast": 1}, "`worker.fast`.*valid boolean, found 1"),
        ({"word": 1}, "`worker.word`.*valid string"),
    ],
)
def test_options_that_are_unknown_or_of_another_type_are_refused(
    registry: Registry[Factory[object]], options: dict[str, bool | int | float | str], sentence: str
) -> None:
    with pytest.raises(UsageError, match=sentence):
        registry.find("worker").checked(options)


def test_an_option_without_a_default_has_to_be_given(registry: Registry[Factory[object]]) -> None:
    with pytest.raises(UsageError, match=r"give `--set options.eager.times=VALUE`"):
        registry.find("eager").checked({})
    assert registry.find("eager").checked({"times": 2}) == {"times": 2}


def test_facts_and_options_that_make_no_sense_are_refused(registry: Registry[Factory[object]]) -> None:
    registry.register("odd", Odd)
    entry = registry.find("odd")
    with pytest.raises(UsageError, match=r"`summary` of the trial 'odd' that was registered is 3; it must be of"):
        assert entry.summary
    with pytest.raises(UsageError, match=r"options of the trial 'odd' .* cannot be read"):
        entry.checked({})
