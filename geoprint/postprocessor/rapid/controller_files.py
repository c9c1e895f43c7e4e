"""What a controller needs before the first load: signals, ties of events, the module that outlasts programs, a page.

All of it is the same for every program of a cell. The configuration has the form of controllers' own backups, and no
device: which board and bit an output hangs on, only the person at the cell knows.
"""

from __future__ import annotations

from collections.abc import Sequence

from geoprint.model import Cell, Placement
from geoprint.postprocessor.rapid import writing
from geoprint.postprocessor.rapid.templates import conditions, filled, unit_words
from geoprint.postprocessor.rapid.writing import output_names, output_words

# Name of each file, and of the package's text that it is made of.
_FILES = {
    "GeoResident.sys": "geo_resident.sys",
    "EIO.cfg": "geo_eio.cfg",
    "SYS.cfg": "geo_sys.cfg",
    "first_load.md": "first_load.md",
}


def controller_files(cell: Cell, *, placement: Placement, loading: bool, folders: Sequence[str] = ()) -> dict[str, str]:
    """Return name and text of each file.

    Args:
        cell: its outputs and arm.
        placement: whether all of it was stated: the page says what to try.
        loading: whether the program loads its modules while it runs.
        folders: of the layers or attitudes that the program loads, in their order; none for a program by itself.

    Raises:
        UsageError: an output has no RAPID name or is missing.
    """
    holding = conditions(cell, placement=placement, loading=loading, stacked=bool(folders))
    names = output_names(cell.signals)
    words = output_words(names) | {
        "NAMES": ", ".join(names.values()),
        "ARM": cell.robot.model,
        "LAG": writing.significant(cell.signals.flow_lag),
        "FIRST": folders[0] if folders else "",
        "LAST": folders[-1] if folders else "",
        "COUNT": str(len(folders)),
        **unit_words(placement),
    }
    return {name: filled(template, holding=holding, words=words) for name, template in _FILES.items()}
