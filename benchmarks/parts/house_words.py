"""The words that CONTRIBUTING retires, where they still stand in the package, and names that two classes share."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import final

from benchmarks.parts.house_tree import PACKAGE, House

CONTRIBUTING = ".github/CONTRIBUTING.md"
# Of the rows behind this heading: what is retired, what is said instead, where it stays.
HEADING = "| retired |"
# A capital or an end of a word in a name ends a word too: `WayBack`, `tip_ways`.
_IN_NAMES = r"(?:(?<![A-Za-z]){word}|(?<![a-z]){capital})(?![a-z])"


@final
@dataclass(frozen=True, slots=True)
class Retired:
    """A word that is not said any more.

    Attributes:
        word: or words.
        phrases: that may hold it all the same.
        rooms: of the package that may.
    """

    word: str
    phrases: Sequence[str]
    rooms: Sequence[str]

    def found(self, line: str) -> bool:
        """Return whether a line says it outside these phrases."""
        for phrase in self.phrases:
            line = re.sub(rf"\b{re.escape(phrase)}\b", "", line, flags=re.IGNORECASE)
        pattern = _IN_NAMES.format(word=re.escape(self.word), capital=re.escape(self.word.capitalize()))
        return re.search(pattern, line) is not None


def retired(house: House) -> Sequence[Retired]:
    """Return what CONTRIBUTING lists as retired."""
    text = (house.root / CONTRIBUTING).read_text(encoding="utf-8")
    rows = text[text.index(HEADING) :].split("\n\n")[0].splitlines()[2:]
    found: list[Retired] = []
    for row in rows:
        words, _, stays = row.strip("|").split("|")
        allowed = re.findall(r"`([^`]+)`", stays)
        phrases, rooms = ([each for each in allowed if ("/" in each) is folder] for folder in (False, True))
        found += [Retired(word, phrases, rooms) for word in re.findall(r"`([^`]+)`", words)]
    return found


def offences(house: House) -> Iterator[str]:
    """Yield a line for each place where a retired word stands, by room, and for each name that two classes have."""
    words = retired(house)
    for room in (PACKAGE, *house.rooms):
        for module in house.members(room):
            path = module.path.relative_to(house.root).as_posix()
            told = [each for each in words if not any(path.startswith(f"{PACKAGE}/{one}") for one in each.rooms)]
            # A phrase may go on in the next line.
            lines = module.path.read_text(encoding="utf-8").splitlines()
            for number, line in enumerate(lines, start=1):
                around = " ".join(part.strip("# ") for part in lines[max(number - 2, 0) : number + 1])
                for each in told:
                    if each.found(line) and each.found(around):
                        yield f"{path}:{number}: `{each.word}`: {line.strip()}"
    yield from shared_names(house)


def shared_names(house: House) -> Iterator[str]:
    """Yield a line for each name that two classes of the package have."""
    places: defaultdict[str, list[str]] = defaultdict(list)
    for module in house.modules.values():
        for name in module.classes:
            places[name].append(module.name)
    for name, modules in sorted(places.items()):
        if len(modules) > 1:
            yield f"{name} is a class of {' and of '.join(modules)}"
