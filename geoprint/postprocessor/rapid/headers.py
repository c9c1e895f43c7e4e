"""The comment at the head of a module, held against the sentences that it must say."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import takewhile

from geoprint.errors import VerificationError
from geoprint.postprocessor.execution import refusal
from geoprint.postprocessor.rapid.switches import CELL_MODULE, STACK_MODULE

# What every program is held against, and what a controller has to keep for it.
_COMPARED = "Checked: the text matches the plan: targets, speeds, zones, outputs, frames."
_RESIDENT = "It needs GeoResident.sys, which shuts outputs off at stops: controller/first_load.md."
# How sentences of headers begin; each begins in a line of its own.
_BEGINS = (
    "Written by ", "Fixture ", "PLACEMENT ", "Not stated: ", "Surface ", "Part: ", "Cell: ", "Spacing: ", "Layer ",
    "Checked: ", "Not checked: ", "It needs ", "A person sets ",
)  # fmt: skip


def header_findings(files: Mapping[str, str], sentences: Sequence[str]) -> Iterator[VerificationError]:
    """Yield where a header of a program does not say what it must, or claims another check.

    Args:
        files: text of each file of the program.
        sentences: that it must say, besides what a controller has to keep for it.
    """
    wanted = [*sentences, _COMPARED, _RESIDENT]
    for name in sorted(files.keys() & {CELL_MODULE, "GeoPrint.mod"}):
        found = _header(files[name])
        for sentence in wanted:
            if not any(_says(each, sentence) for each in found):
                yield refusal(name, 2, f"the header must say {sentence[:100]!r}, as plan.json does")
        for each in found:
            judged = each.startswith(("Checked:", "Notchecked:"))
            if judged and not any(_says(each, sentence) for sentence in wanted):
                yield refusal(name, 2, f"the header says {each[:100]!r}, plan.json does not")


def joined_header_findings(files: Mapping[str, str], sentences: Sequence[str]) -> Iterator[VerificationError]:
    """Yield where the header of a program of several does not say what it must: as `header_findings`."""
    found = _header(files.get(STACK_MODULE, ""))
    for sentence in [*sentences, _RESIDENT]:
        if not any(_says(each, sentence) for each in found):
            yield refusal(STACK_MODULE, 2, f"the header must say {sentence!r}")


def _header(text: str) -> list[str]:
    """Return the sentences in the comment at the beginning of a module, without spaces: lines break anywhere."""
    lines = takewhile(lambda line: line.startswith("  ! "), text.split("\n")[1:])
    sentences: list[str] = []
    for line in lines:
        bare = line.removeprefix("  ! ")
        if not sentences or bare.startswith(_BEGINS) or bare[:1].isdigit():
            sentences.append("")
        sentences[-1] += "".join(bare.split())
    return sentences


def _says(found: str, wanted: str) -> bool:
    """Return whether a sentence of a header, without spaces, is one that it must have; a long one is cut."""
    plain = "".join("".join(letter if " " <= letter <= "~" else "?" for letter in wanted).split())
    return found == plain or (found.endswith("...") and plain.startswith(found.removesuffix("...")))
