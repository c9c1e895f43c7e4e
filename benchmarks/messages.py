"""What does geoprint say to people, and where is it not plain English?

    python -m benchmarks.messages [--faults] [--smoke]

All texts of the package that people read, one a line with its place: messages, notes, verdicts, help, captions, and
what stands in a program as a comment. They come from the source: strings of several words that are no docstring, what a
string puts in from the code in braces, `[one|other]` where it depends. With --faults, only what breaks a rule of
CONTRIBUTING, with the rule. `tests/architecture/test_messages.py` holds the package to it.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import final

from benchmarks import ROOT
from benchmarks.code_base import SCRIPTS
from benchmarks.parts.tables import script_parser

PACKAGE = ROOT / "geoprint"
# Words of a sentence at most.
MOST_WORDS = 25
# A text that people read has so many words of small letters.
FEWEST_WORDS = 3
WORD = re.compile(r"[a-z]{2,}")
SENTENCE_END = re.compile(r"[.!?](?:\s+|$)|\n+")
# What a string puts in, as `texts` shows it.
VALUE = re.compile(r"\{[^{}]*\}")
NEGATION = r"(?:not|never|no|none|nothing|nobody|nowhere|neither|cannot|without|lacks?)"
# Two negations in one clause: a comma, a colon, a bracket or a word that begins another clause end it.
DOUBLE_NEGATION = re.compile(
    rf"\b{NEGATION}\b(?:(?!\b(?:and|or|but|nor|because|so|where|which|that|if|until|as|since|whether|when|from|while)\b)"
    rf"[^,;:.()\[\]|`\n])*\b(?:{NEGATION}|un(?:known|stated|measured|checked|able|named)|im\w+ible)\b",
    re.IGNORECASE,
)
PYDANTIC = re.compile(r"Input should|Field required|Value error|validation error|type=\w+_")
# Words that the glossary replaces, where they are no name.
RETIRED = re.compile(r"\b(?:told|tells|laid|lays|silico|mended|aloft)\b")
# A share is in per cent behind a space: `percent` writes it; a style sheet's has none.
PERCENT_FORMAT = ":%}"
PERCENT = re.compile(rf"[\d}}]%(?!;)|{PERCENT_FORMAT}")
# A count of one needs its singular: `how_many` says it.
COUNT = re.compile(
    r"(?<!of )"
    r"\{(?:len\([^{}]*\)|[^{}]*\.(?:count|size)|[a-z_.]*\b(?:count|runs|faces|voxels|targets|poses|findings|files))\} "
    r"(?!degrees\b|as\b|is\b|has\b|was\b|times\b|this\b|less\b|across\b|always\b|does\b)(?:[a-z]+ )?[a-z]+[a-rt-z]s\b"
)
# Errors whose text is not English for people, by what they are caught as.
MACHINE_ERRORS = {"OSError": "errno", "ValidationError": "pydantic"}
# Methods of strings whose arguments are looked for or, of `split`, what they are called on: no text.
OF_TEXTS = {"split", "replace", "startswith", "removeprefix"}
LETTERS_OF_LISTS = "abcdefghijklmnopqrstuvwxyz0123456789_ "
RULES: Mapping[str, str] = {
    "words": f"more than {MOST_WORDS} words in a sentence",
    "negation": "two negations in a clause",
    "pydantic": "pydantic's text",
    "errno": "the number of a system error",
    "class": "the name of a class",
    "none": "'None'",
    "retired": "a word that the glossary replaces",
    "count": "a plural that stays with a count of one",
    "percent": "per cent without a space",
}


@final
@dataclass(frozen=True, slots=True)
class Text:
    """What people read.

    Attributes:
        path: of the file, from the package.
        line: where it begins.
        words: the text; values in braces, alternatives in brackets.
        caught: by the name of a value in it, the error that it was caught as.
    """

    path: str
    line: int
    words: str
    caught: Mapping[str, str]


def main() -> None:
    """Print the texts, or what breaks a rule."""
    parser = script_parser(__doc__, smoke="the same: it takes seconds")
    parser.add_argument("--faults", action="store_true", help="only what breaks a rule, with the rule")
    arguments = parser.parse_args()
    for text in texts():
        for said in faults(text) if arguments.faults else [""]:
            print(f"{text.path}:{text.line}: {said}{text.words!r}")


def texts(root: Path = PACKAGE) -> Iterator[Text]:
    """Yield the texts of all modules below a folder, in order; not of the guide's scripts, which are to be copied."""
    for path in sorted(path for path in root.rglob("[!_]*.py") if path.parent.name != SCRIPTS):
        yield from texts_of(path.read_text(encoding="utf-8"), path=path.relative_to(root).as_posix())


def texts_of(source: str, *, path: str = "") -> Iterator[Text]:
    """Yield the texts of a module, in order."""
    pending: list[tuple[ast.AST, Mapping[str, str]]] = [(ast.parse(source), {})]
    while pending:
        node, caught = pending.pop()
        if isinstance(node, ast.ExceptHandler) and node.name and node.type:
            kinds = [ast.unparse(each) for each in getattr(node.type, "elts", [node.type])]
            known = {node.name: kind for kind in kinds if kind in MACHINE_ERRORS}  # noqa: B035  (the last one)
            caught = {**caught, **known}
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            continue  # A docstring.
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr in OF_TEXTS:
            node.args, node.func.value = [], ast.Constant(None) if node.func.attr == "split" else node.func.value
        if isinstance(node, ast.JoinedStr | ast.Constant | ast.BinOp) and (
            _is_text(words := _words(node)) or PERCENT_FORMAT in words
        ):
            yield Text(path, getattr(node, "lineno", 0), words, caught)
        else:
            pending += [(each, caught) for each in reversed(list(ast.iter_child_nodes(node)))]


def sentences(words: str) -> list[str]:
    """Return the sentences of a text."""
    return [each for each in SENTENCE_END.split(words) if each.strip()]


def faults(text: Text) -> Iterator[str]:
    """Yield the rules that a text breaks, each as the start of a line."""
    plain = VALUE.sub("{}", text.words)
    found = {
        "words": any(count_words(each) > MOST_WORDS for each in sentences(plain)),
        "negation": DOUBLE_NEGATION.search(plain) is not None,
        "pydantic": PYDANTIC.search(plain) is not None or _puts_in(text, "ValidationError"),
        "errno": _puts_in(text, "OSError"),
        "class": any("__name__" in each for each in VALUE.findall(text.words))
        or any(name in class_names() for name in re.findall(r"\w+", plain)),
        "none": re.search(r"\bNone\b", plain) is not None,
        "retired": RETIRED.search(plain) is not None,
        "count": COUNT.search(text.words) is not None,
        "percent": PERCENT.search(text.words) is not None,
    }
    yield from (f"{RULES[rule]}: " for rule, broken in found.items() if broken)


def count_words(sentence: str) -> int:
    """Return the words of a sentence, a value, a point or a command as one; of alternatives the longest counts."""
    longest = re.compile(r"\[([^\[\]|]*)\|([^\[\]|]*)\]")
    while found := longest.search(sentence):
        sentence = sentence[: found.start()] + max(found.groups(), key=len) + sentence[found.end() :]
    sentence = re.sub(r"\(\{\}(?:, \{\})+\)|`[^`]*`", "{}", sentence)  # A point, a command.
    return sum(any(letter.isalnum() or letter == "{" for letter in word) for word in sentence.split())


@cache
def class_names() -> frozenset[str]:
    """Return the names of the package's classes that are no words: with two capitals."""
    modules = (path.read_text(encoding="utf-8") for path in PACKAGE.rglob("*.py"))
    names = (name for module in modules for name in re.findall(r"^ *class (\w+)", module, re.MULTILINE))
    return frozenset(name for name in names if re.search(r"[a-z][A-Z]", name))


def _is_text(words: str) -> bool:
    return " " in words and len(WORD.findall(VALUE.sub("", words))) >= FEWEST_WORDS and not _is_code(words)


def _is_code(words: str) -> bool:
    """Return whether a string is an expression of Python, as the name of a type is, or a list of words."""
    try:
        ast.parse(words, mode="eval")
    except SyntaxError:
        return words[-1:] == " " and not set(words) - set(LETTERS_OF_LISTS)
    return True


def _words(node: ast.AST) -> str:
    """Return what a node says: a string, strings joined, or one of two."""
    if isinstance(node, ast.Constant):
        return node.value if isinstance(node.value, str) else ""
    if isinstance(node, ast.JoinedStr):
        return "".join(map(_words, node.values))
    if isinstance(node, ast.FormattedValue):
        percent = ":%" if ast.unparse(node.format_spec or node).endswith("%'") else ""
        return _words(node.value) if isinstance(node.value, ast.IfExp) else "{" + _name(node.value) + percent + "}"
    if isinstance(node, ast.IfExp):
        return f"[{_words(node.body)}|{_words(node.orelse)}]"
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add):
        return _words(node.left) + _words(node.right)
    return "{" + _name(node) + "}"


def _name(node: ast.AST) -> str:
    return re.sub(r"[{}]", "", ast.unparse(node))


def _puts_in(text: Text, kind: str) -> bool:
    """Return whether a text puts in an error of a kind whole."""
    whole = re.findall(r"\{(?:str\()?(\w+)\)?\}", text.words)
    return any(text.caught.get(name) == kind for name in whole)


if __name__ == "__main__":
    main()
