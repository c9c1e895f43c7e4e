"""The words that CONTRIBUTING's glossary replaces, where they still stand in the package, and names of two classes."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence

from benchmarks.parts.house_tree import House

CONTRIBUTING = ".github/CONTRIBUTING.md"
# Of the rows behind this heading: what to say, and instead of what.
HEADING = "| say | not |"


def retired(house: House) -> Sequence[tuple[str, str]]:
    """Return the words of the glossary that are not said any more, each with what is said instead."""
    text = (house.root / CONTRIBUTING).read_text(encoding="utf-8")
    rows = text[text.index(HEADING) :].split("\n\n")[0].splitlines()[2:]
    cells = [row.strip("| ").split("|") for row in rows]
    return [(word, say.strip()) for say, words in cells for word in re.findall(r"`([^`]+)`", words)]


def said(house: House, word: str) -> Mapping[str, int]:
    """Return how often each module says a word, in text or as a part of a name such as `TipWay` or `way_back`."""
    first, rest = re.escape(word[0]), re.escape(word[1:])
    pattern = re.compile(rf"(?:(?<![A-Za-z]){first}|(?<![A-Z]){first.upper()}){rest}(?![a-z])")
    counts = {
        name: len(pattern.findall(module.path.read_text(encoding="utf-8"))) for name, module in house.modules.items()
    }
    return {name: count for name, count in counts.items() if count}


def shared_names(house: House) -> Iterator[str]:
    """Yield a line for each name that two classes of the package have."""
    places: defaultdict[str, list[str]] = defaultdict(list)
    for module in house.modules.values():
        for name in module.classes:
            places[name].append(module.name)
    for name, modules in sorted(places.items()):
        if len(modules) > 1:
            yield f"{name} is a class of {' and of '.join(modules)}"
