"""No regular expression of the package takes more than linear time, whatever text it is given.

All of them are collected from the source. Texts are made of what each pattern itself asks for, repeated, with an end
that it does not expect: that is where a matcher goes back and tries anew.
"""

from __future__ import annotations

import ast
import re
import signal
import time
from collections.abc import Iterator
from functools import cache
from itertools import product
from pathlib import Path
from types import FrameType

import pytest

import geoprint

PACKAGE = Path(geoprint.__file__).parent
METHODS = frozenset({"match", "fullmatch", "search", "sub", "subn", "split", "findall", "finditer"})
CALL = re.compile(rf"\.(?:compile|{'|'.join(METHODS)})\b")
# Letters of a text; a pattern that is quadratic takes 0.1 s and more for it, a linear one less than a millisecond.
LENGTH = 12_000
MOST_SECONDS = 0.05
FLAGS = {name: getattr(re, name) for name in ("IGNORECASE", "MULTILINE", "DOTALL", "ASCII", "VERBOSE", "I", "M", "S")}


@cache
def sources() -> dict[Path, list[ast.AST]]:
    """Return the nodes of all files in which a pattern may stand or be used."""
    texts = {path: path.read_text(encoding="utf-8") for path in sorted(PACKAGE.rglob("*.py"))}
    return {path: [*ast.walk(ast.parse(text))] for path, text in texts.items() if CALL.search(text)}


def flags_of(node: ast.AST | None) -> int:
    names = [each.attr for each in ast.walk(node) if isinstance(each, ast.Attribute)] if node else []
    return sum({int(FLAGS[name]) for name in names if name in FLAGS})


@cache
def used_methods() -> dict[str, set[str]]:
    """Return for each name the methods of a pattern that are called on it; a private name has its module before it."""
    found: dict[str, set[str]] = {}
    for path, nodes in sources().items():
        for node in nodes:
            if isinstance(node, ast.Attribute) and node.attr in METHODS and isinstance(node.value, ast.Name):
                found.setdefault(full_name(path, node.value.id), set()).add(node.attr)
    return found


def full_name(path: Path, name: str) -> str:
    return f"{path}:{name}" if name.startswith("_") else name


def constant(node: ast.AST) -> str | None:
    """Return a pattern as written; what is put into it at run time is one word."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return node.value
    if isinstance(node, ast.JoinedStr):
        parts = [part.value if isinstance(part, ast.Constant) else "word" for part in node.values]
        return "".join(map(str, parts))
    return None


def patterns() -> Iterator[tuple[str, str, int, frozenset[str]]]:
    """Yield where each pattern stands, its text, flags and the methods that it is used by."""
    for path, nodes in sources().items():
        names = {
            id(node.value): target.id
            for node in nodes
            if isinstance(node, ast.Assign | ast.AnnAssign) and node.value is not None
            for target in (node.targets if isinstance(node, ast.Assign) else [node.target])
            if isinstance(target, ast.Name)
        }
        for node in nodes:
            called = node.func if isinstance(node, ast.Call) else None
            if not isinstance(called, ast.Attribute) or not isinstance(called.value, ast.Name):
                continue
            if called.value.id != "re" or called.attr not in METHODS | {"compile"} or not isinstance(node, ast.Call):
                continue
            text = constant(node.args[0])
            where = f"{path.relative_to(PACKAGE)}:{node.lineno}"
            if text is None:
                continue
            at = {"compile": 1, "sub": 4, "subn": 4, "split": 3}.get(called.attr, 2)
            given = [each.value for each in node.keywords if each.arg == "flags"]
            flags = flags_of(node.args[at] if len(node.args) > at else given[0] if given else None)
            name = full_name(path, names.get(id(node), ""))
            methods = used_methods().get(name, {"search"}) if called.attr == "compile" else {called.attr}
            yield where, text, flags, frozenset(methods)


def pieces(pattern: str) -> list[str]:
    """Return short texts out of what a pattern asks for: its letters, words and classes."""
    plain = re.sub(r"\\[sSwWdDbBAZ]|\(\?[:=!<P]?|[\[\]()|*+?{}^$]", " ", pattern)
    words = {re.sub(r"\\(.)", r"\1", word) for word in plain.split() if len(word) <= 12}
    signs = set("".join(words)) - {" "}
    classes = {r"\s": " \t\n", r"\w": "aA0_", r"\d": "01", ".": "a(", r"[ \t]": " \t"}
    for name, letters in classes.items():
        if name in pattern:
            signs |= set(letters)
    found = sorted(signs)[:24] + sorted(words)[:12] + ["a", "0", " ", "\n", "a:=", "a,", "0.", "(", "#"]
    return list(dict.fromkeys(each for each in found if each))


class SlowError(Exception):
    """A pattern was still busy when its time was over."""


def _interrupt(_: int, __: FrameType | None) -> None:
    raise SlowError


def seconds(compiled: re.Pattern[str], method: str, text: str) -> float:
    """Return the processor time that a pattern takes for a text, at most `MOST_SECONDS` and a little."""
    before = signal.signal(signal.SIGVTALRM, _interrupt)
    signal.setitimer(signal.ITIMER_VIRTUAL, MOST_SECONDS)
    begun = time.process_time()
    try:
        call = getattr(compiled, method)
        found = call("", text) if method in {"sub", "subn"} else call(text)
        if method == "finditer":
            list(found)
    except SlowError:
        return MOST_SECONDS
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0.0)
        signal.signal(signal.SIGVTALRM, before)
    return time.process_time() - begun


def slow_texts(pattern: str, flags: int, methods: frozenset[str]) -> Iterator[str]:
    """Yield descriptions of texts for which a pattern takes too long."""
    compiled = re.compile(pattern, flags)
    parts = pieces(pattern)
    joined = [*[each for each in parts if not each.isalnum() and not each.isspace()][:7], " ", "a", "0", "a:="]
    pumps = [*parts, *(a + b for a, b in product(joined, joined) if a != b)]
    begins = ["", *[each for each in parts if len(each) > 1 and each.isalnum()][:1], "a"]
    for pump in pumps:
        for begin in begins:
            text = begin + pump * (LENGTH // len(pump)) + "\0!"
            for method in methods:
                # What a noisy machine makes slow once is fast the next time.
                if all(seconds(compiled, method, text) >= MOST_SECONDS for _ in range(2)):
                    yield f"{method} of {begin!r} and many {pump!r}"
                    return


FOUND = sorted(patterns())


@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="the time of a pattern cannot be bounded here")
@pytest.mark.parametrize(("where", "pattern", "flags", "methods"), FOUND, ids=[each[0] for each in FOUND])
def test_a_pattern_takes_linear_time(where: str, pattern: str, flags: int, methods: frozenset[str]) -> None:
    assert list(slow_texts(pattern, flags, methods)) == [], f"{where}: {pattern!r}"


@pytest.mark.parametrize(
    ("pattern", "method"),
    [(r"(a+)+b", "match"), (r"((?:\s*\\\w+(?::=[^,;]*)?\s*,?)*)\s*(\w+)\s*[,;]", "match"), (r"^\s*x", "search")],
    ids=["exponential", "of old", "quadratic"],
)
def test_what_is_slow_is_found(pattern: str, method: str) -> None:
    assert list(slow_texts(pattern, int(re.MULTILINE), frozenset({method})))


def test_patterns_are_collected() -> None:
    texts = {text for _, text, _, _ in FOUND}
    assert len(FOUND) > 30
    assert r"[-+]?(?:\d+(?:[.,]\d*)?|[.,]\d+)(?:[eE][-+]?\d+)?" in texts
