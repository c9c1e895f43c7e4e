"""How large is the package, and which retired words does it still say?

    python -m benchmarks.house [--words] [--smoke]

A row has the modules of a folder, their lines, the longest module and function, how many names its `__init__.py` makes
public, and what the contract in pyproject.toml lets it import. The core is what `plan` and `compare` need to reach
their files, each name looked up where it is made; it is counted in lines of code, without blank lines, comments and
docstrings. With --words, how often each word that CONTRIBUTING's glossary replaces stands in the package, and names
that two classes share. Nothing here is a limit.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence

from benchmarks.parts.house_tree import PACKAGE, House, Module
from benchmarks.parts.house_words import retired, said, shared_names
from benchmarks.parts.tables import row, rule

CORE = ("plan", "compare", "compare_parts", "save_plan", "save_comparisons")
HEADINGS = ("package", "modules", "lines", "code", "longest module", "longest function", "public names", "may import")


def main() -> None:
    """Print the table and the core, or the words."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--words", action="store_true", help="count retired words and shared names instead")
    parser.add_argument("--smoke", action="store_true", help="the same: it takes two seconds")
    arguments = parser.parse_args()
    house = House()
    lines = words(house) if arguments.words else [*table(house), "", core(house)]
    for line in lines:
        print(line)


def table(house: House) -> Iterator[str]:
    """Yield a row for each package, from the top down."""
    yield row(*HEADINGS)
    yield rule(len(HEADINGS))
    for room in (PACKAGE, *house.rooms):
        modules = house.members(room)
        below = house.rooms if room == PACKAGE else house.may_import(room)
        longest, function = max(modules, key=lambda each: each.lines), longest_function(modules)
        yield row(
            room.removeprefix(f"{PACKAGE}."),
            str(len(modules)),
            str(sum(each.lines for each in modules)),
            str(sum(each.code for each in modules)),
            f"{longest.path.name} {longest.lines}",
            f"{function[0]} {function[1]}",
            str(len(modules[0].public)),
            "all" if room == PACKAGE else ", ".join(name.removeprefix(f"{PACKAGE}.") for name in below),
        )
    every = house.modules.values()
    sums = len(every), sum(each.lines for each in every), sum(each.code for each in every)
    yield row("**together**", *map(str, sums), "", "", "", "")


def core(house: House) -> str:
    """Return how large the core is."""
    modules = house.needed(*(f"{PACKAGE}.pipeline.{name}" for name in CORE)).values()
    lines, code = sum(each.lines for each in modules), sum(each.code for each in modules)
    return f"core: {len(modules)} modules, {code} lines of code ({lines} with docstrings, comments and blank lines)"


def words(house: House) -> Iterator[str]:
    """Yield how often each retired word is said, and which names two classes share."""
    yield row("not", "say", "times", "modules")
    yield rule(4)
    for word, better in retired(house):
        counts = said(house, word)
        yield row(word, better, str(sum(counts.values())), str(len(counts)))
    yield from shared_names(house)


def longest_function(modules: Sequence[Module]) -> tuple[str, int]:
    """Return name and lines of the longest function."""
    return max((each for module in modules for each in module.functions), key=lambda each: each[1], default=("-", 0))


if __name__ == "__main__":
    main()
