"""How does the house stand? Prints a row for each room and wing, and the size of the core.

    python -m benchmarks.house [--words] [--draw] [--smoke]

A row has the files of a folder, their lines, the longest module and function, how many names the door holds, and what
the contract in pyproject.toml lets the room import; what breaks a rule is set in bold, and the run ends with status 1.
The core is what `plan` and `compare` need to reach their files, each name looked up where it is made; it is counted in
lines of code, without blank lines, comments and docstrings. With --words the retired words that stand in the code are
listed by room, with --draw the picture in CONTRIBUTING is drawn anew.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Sequence

from benchmarks.parts.house_picture import PICTURE, picture
from benchmarks.parts.house_tree import PACKAGE, House, Module
from benchmarks.parts.house_words import offences
from benchmarks.parts.tables import row, rule

MOST_FILES, LONGEST_MODULE, LONGEST_FUNCTION = 20, 350, 50
# Lines of code that the core may have: 20 000 until programs were executed, for which language and machine take 4 200;
# 30 000 until refusals proved themselves, which takes 800; 31 000 until rows followed curves and layers lay on layers,
# which takes 900; 32 000 until a stack of them was printed by one program, which takes 500; 36 000 until tables tilted
# the part, which takes 1 000, and overhang was measured; 37 500 until fibres were of more than one width and programs
# printed over such a table, which takes 1 900; 39 700 until layers were printed and places sought
# over it, and programs were laid in silico; 40 000 until one program printed all layers over it, which takes 100 with
# the table's motion between layers and in the replay.
LARGEST_CORE = 40_800
CORE = ("plan", "compare", "compare_parts", "save_plan", "save_comparisons")
HEADINGS = ("room", "files", "lines", "code", "longest module", "longest function", "public names", "may import")


def main() -> None:
    """Print the table, the core and what was asked for beside."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--words", action="store_true", help="list the retired words that stand in the code")
    parser.add_argument("--draw", action="store_true", help=f"write {PICTURE}")
    parser.add_argument("--smoke", action="store_true", help="the same: it takes two seconds")
    arguments = parser.parse_args()
    house = House()
    if arguments.words:
        for offence in offences(house):
            print(offence)
        return
    if arguments.draw:
        (house.root / PICTURE).write_text(picture(house), encoding="utf-8")
    for line in [*table(house), "", core(house)]:
        print(line)
    broken = breaches(house)
    for breach in broken:
        print(breach)
    sys.exit(1 if broken else 0)


def table(house: House) -> Iterator[str]:
    """Yield a row for each room and wing, from the top of the house down."""
    yield row(*HEADINGS)
    yield rule(len(HEADINGS))
    for room in (PACKAGE, *house.rooms):
        modules = house.members(room)
        below = house.rooms if room == PACKAGE else house.may_import(room)
        longest, function = max(modules, key=lambda each: each.lines), longest_function(modules)
        yield row(
            room.removeprefix(f"{PACKAGE}."),
            marked(len(modules), at_most=MOST_FILES),
            str(sum(each.lines for each in modules)),
            str(sum(each.code for each in modules)),
            f"{longest.path.name} {marked(longest.lines, at_most=LONGEST_MODULE)}",
            f"{function[0]} {marked(function[1], at_most=LONGEST_FUNCTION)}",
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
    return (
        f"core: {len(modules)} modules, {marked(code, at_most=LARGEST_CORE)} lines of code of at most {LARGEST_CORE} "
        f"({lines} with docstrings, comments and blank lines)"
    )


def breaches(house: House) -> Sequence[str]:
    """Return a sentence for each folder, module and function that is too long, and each import that goes upwards."""
    found: list[str] = []
    for folder in sorted({each.path.parent for each in house.modules.values()}):
        count = len(list(folder.glob("*.py")))
        if count > MOST_FILES:
            found.append(f"{folder.relative_to(house.root)} holds {count} modules, allowed are {MOST_FILES}.")
    for module in house.modules.values():
        where = module.path.relative_to(house.root)
        if module.lines > LONGEST_MODULE:
            found.append(f"{where} has {module.lines} lines, allowed are {LONGEST_MODULE}.")
        for name, lines in module.functions:
            if lines > LONGEST_FUNCTION:
                found.append(f"{where}: {name} has {lines} lines, allowed are {LONGEST_FUNCTION}.")
    found += [f"{one} imports {other}, which stands above it." for one, other in house.upwards()]
    return found


def longest_function(modules: Sequence[Module]) -> tuple[str, int]:
    """Return name and lines of the longest function."""
    return max((each for module in modules for each in module.functions), key=lambda each: each[1], default=("-", 0))


def marked(count: int, *, at_most: int) -> str:
    """Return a figure, in bold where it breaks a rule."""
    return f"{count}" if count <= at_most else f"**{count}**"


if __name__ == "__main__":
    main()
