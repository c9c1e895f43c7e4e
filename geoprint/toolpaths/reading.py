"""One door for all formats: which one a file has is told by its content."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Protocol, final

from geoprint.delimited import encoding_of
from geoprint.errors import InputError
from geoprint.toolpaths import apt, bundles, gcode, rapid, tables
from geoprint.toolpaths.path_file import PathFile

# Bytes at the beginning of a file by which its format is told; slicers begin with long comments and pictures.
HEAD = 400_000


class PathReader(Protocol):
    """Reads a file of one format."""

    def __call__(self, path: Path, *, deposit: str | None) -> PathFile:
        """Return its deposited runs; `deposit` names what deposits, where the format asks for it."""
        ...


@final
@dataclass(frozen=True, slots=True)
class Format:
    """A format of toolpaths.

    Attributes:
        tells: whether the beginning of a text is of it.
        read: its reader.
    """

    tells: Callable[[str], bool]
    read: PathReader


# In the order in which they are asked; a module of RAPID may hold in a comment what looks like another.
FORMATS: Mapping[str, Format] = MappingProxyType(
    {
        rapid.TITLE: Format(rapid.is_rapid, rapid.read_rapid),
        tables.TITLE: Format(tables.is_table, tables.read_table),
        apt.TITLE: Format(apt.is_apt, apt.read_apt),
        gcode.TITLE: Format(gcode.is_gcode, gcode.read_gcode),
    }
)


def read_paths(path: Path | str, *, deposit: str | None = None, dialect: str | None = None) -> PathFile:
    """Read the deposited runs of a file of toolpaths, or of a bundle's folder.

    Args:
        path: of a table (x, y, z, run), G-code, APT or CLS, a RAPID module or a folder of them, or a bundle.
        deposit: what deposits, where the file does not tell: M-codes as M3/M5, an axis that extrudes as A, or
            the name of an output.
        dialect: of G-code, one of `gcode_codes.DIALECTS`; None to guess it. Other formats have none.

    Raises:
        UsageError: what deposits is named where nothing asks for it, or not named where it must be.
        InputError: the file cannot be read, is of no known format, or a line is wrong; names it.
    """
    path = Path(path)
    if path.is_dir():
        if (path / bundles.POSES).is_file():
            return bundles.read_bundle(path, deposit=deposit)
        if rapid.modules_in(path):
            return rapid.read_rapid(path, deposit=deposit)
        raise InputError(f"`{path}` holds neither a {bundles.POSES} nor modules (.mod); give a bundle or a file.")
    if not path.exists():
        raise InputError(f"`{path}` does not exist; check the name and the folder.")
    # Reading a pipe or a device might never end.
    if not path.is_file():
        raise InputError(f"`{path}` is no plain file; give a file of toolpaths.")
    try:
        with path.open("rb") as stream:
            data = stream.read(HEAD)
    except OSError as error:
        raise InputError(f"`{path}` cannot be read ({error.strerror}); give a file of toolpaths.") from error
    head = data.decode(encoding_of(data), errors="replace")
    for known in FORMATS.values():
        if known.tells(head):
            if known.read is gcode.read_gcode:
                return gcode.read_gcode(path, deposit=deposit, dialect=dialect)
            return known.read(path, deposit=deposit)
    raise InputError(
        f"{path.name}, line 1: this is no known format of toolpaths; known are tables whose first row names x, y "
        "and z, G-code, APT or CLS (GOTO/), RAPID modules and bundles of geoprint."
    )
