"""What a person should mind, by weight: warnings to act on, notes, details, then what was not checked."""

from __future__ import annotations

from collections.abc import Iterable

from geoprint.account.records.rounding import how_many


def marked_lines(
    *,
    warnings: Iterable[str] = (),
    notes: Iterable[str] = (),
    details: Iterable[str] = (),
    not_checked: Iterable[str] = (),
    verbose: bool = False,
) -> list[str]:
    """Return a line for each thing to mind, the weightiest first; none is said twice.

    Args:
        warnings: what to act on.
        notes: what to know.
        details: what is as it should be; none unless all is asked for.
        not_checked: what nobody looked at; as one line with their count, unless all is asked for.
        verbose: whether it is.
    """
    unchecked = list(dict.fromkeys(not_checked))
    if unchecked and not verbose:
        unchecked = [f"{how_many(len(unchecked), 'thing')}; `--verbose` lists them"]
    return [
        *(f"warning: {text}" for text in dict.fromkeys(warnings)),
        *(f"note: {text}" for text in dict.fromkeys(notes)),
        *(f"detail: {text}" for text in dict.fromkeys(details) if verbose),
        *(f"not checked: {text}" for text in unchecked),
    ]
