"""Small changes of the RAPID texts that come with the package, each of which a test should notice."""

from __future__ import annotations

import re
from collections.abc import Iterator

from benchmarks.mutants.syntax import Mutant

_SWAPPED = {
    "<": ">", ">": "<", "<=": "<", ">=": ">", "<>": "=", " AND ": " OR ", " OR ": " AND ", "TRUE": "FALSE",
    "FALSE": "TRUE", "NOT ": "", "\\On": "\\Off", "\\Off": "\\On", "+": "-", "fine": "z1",
}  # fmt: skip
_PLACES = re.compile(r"<>|<=|>=|<(?![A-Z]+>)|(?<![A-Z])>| AND | OR |\bTRUE\b|\bFALSE\b|NOT |\\On\b|\\Off\b|\+|\bfine\b")
_NUMBER = re.compile(r"(?<![\w.])\d+(?![\w.])")
# Lines without which a module cannot be loaded at all: no test needs to find that.
_FRAME = (
    "MODULE", "ENDMODULE", "PROC", "ENDPROC", "FUNC", "ENDFUNC", "IF", "ENDIF", "ELSE", "WHILE", "ENDWHILE",
    "FOR", "ENDFOR", "VAR", "PERS", "CONST", "TEST", "ENDTEST", "CASE", "TRAP", "ENDTRAP", "RECORD", "ENDRECORD",
)  # fmt: skip


def mutants_of_text(file: str, text: str) -> list[Mutant]:
    """Return all mutants of a template, in the order of its lines."""
    lines = text.split("\n")
    found: list[Mutant] = []
    for index, line in enumerate(lines):
        tags, bar, bare = line.rpartition("|") if line.startswith("@") else ("", "", line)
        if not bare.strip() or bare.strip().startswith("!"):
            continue
        for other in _others(bare):
            changed = "\n".join([*lines[:index], *([tags + bar + other] if other else []), *lines[index + 1 :]])
            found.append(Mutant(file, index + 1, f"{bare.strip()} -> {other.strip() or 'nothing'}", changed))
    return found


def _others(line: str) -> Iterator[str]:
    """Yield what may stand in the place of a line; an empty text where it is left out."""
    # What is written on the pendant is for people.
    code = line.split('"')[0]
    if code.strip().rstrip(";").split(" ")[0].split("(")[0] not in _FRAME:
        yield ""
    for match in _PLACES.finditer(code):
        yield line[: match.start()] + _SWAPPED[match[0]] + line[match.end() :]
    for match in _NUMBER.finditer(code):
        yield (
            line[: match.start()]
            + str(1 - int(match[0]) if match[0] in "01" else int(match[0]) + 1)
            + line[match.end() :]
        )
