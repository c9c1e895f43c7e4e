"""Write values into a cell file and keep everything else of it: the other tables, their order, and the comments.

tomlkit writes; the text is parsed again and must differ from the old one in the wanted keys alone.
"""

from __future__ import annotations

import os
import secrets
import tomllib
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias, cast

from geoprint.errors import ExportError, UsageError, VerificationError

if TYPE_CHECKING:
    from tomlkit.items import Item, Table

TomlValue: TypeAlias = "str | float | Sequence[TomlValue]"

# Of lengths and angles in a cell file: a tenth of what any arm repeats, and more.
DECIMALS = 4
# As in every file of geoprint.
LINE_LENGTH = 120


def edited(text: str, *, table: str, values: Mapping[str, TomlValue | None], name: str) -> str:
    r"""Return a TOML text with the values of one table replaced.

    A key keeps its place and the comment behind it; one that is new follows the table's last key. Comments within a
    list that is replaced go with it.

    Args:
        text: of the whole file; valid TOML.
        table: name of a table that has its own header.
        values: by key; None removes the key.
        name: what messages call the file.

    Raises:
        UsageError: the table has no header of its own, or the text is laid out so that it cannot be edited safely.

    Examples:
        >>> text = "[work]  # here\nsource = 'demo'  # so far"
        >>> edited(text, table="work", values={"source": "x", "rms": 0.1}, name="a.toml").splitlines()
        ['[work]  # here', 'source = "x"  # so far', 'rms = 0.1']
    """
    import tomlkit
    from tomlkit.items import Table

    windows = "\r\n" in text
    document = tomlkit.parse(text.replace("\r\n", "\n"))
    found = cast("Mapping[str, object]", document).get(table)
    if not isinstance(found, Table) or found.is_super_table():
        raise UsageError(f"{name} has no table [{table}] with a header of its own; write one as in `geoprint init`.")
    for key, value in values.items():
        if key not in found:
            continue
        if value is None:
            found.remove(key)
        else:
            found[key] = _item(key, value)
    _append(found, {key: value for key, value in values.items() if value is not None and key not in found})
    result = document.as_string().replace("\n", "\r\n" if windows else "\n")
    if not _differs_only(text, result, table=table, values=values):
        raise UsageError(
            f"{name} cannot be edited without changing more than [{table}]: write that table with one plain key a line."
        )
    return result


def write_cell(path: Path | str, text: str, *, overwrite: bool, verify: Callable[[Path], None]) -> None:
    """Write a cell file so that it appears complete and verified, or not at all.

    Args:
        path: where it shall stand.
        text: of the whole file.
        overwrite: whether an existing file may be replaced.
        verify: called with the written file before it takes its place; what it raises ends the writing.

    Raises:
        UsageError: the file exists and may not be replaced.
        ExportError: it cannot be written there.
    """
    check_cell_writable(path, overwrite=overwrite)
    place = Path(path).resolve()
    temporary = place.with_name(f".{place.name}.tmp-{os.getpid()}-{secrets.token_hex(4)}")
    try:
        with temporary.open("x", encoding="utf-8", newline="") as handle:
            handle.write(text)
            handle.flush()
            os.fsync(handle.fileno())
        if temporary.read_bytes() != text.encode():
            raise VerificationError(f"{path} does not read back as it was written; the disk may be faulty: try again.")
        verify(temporary)
        if overwrite:
            temporary.replace(place)
        else:
            # Unlike a rename this fails where somebody else has written the file meanwhile.
            place.hardlink_to(temporary)
    except OSError as error:
        raise ExportError(f"cannot write {path}: {error.strerror or error}; choose another place.") from error
    finally:
        with suppress(OSError):
            temporary.unlink(missing_ok=True)


def check_cell_writable(path: Path | str, *, overwrite: bool) -> None:
    """Check that a cell file may stand somewhere, before any work.

    Raises:
        UsageError: the file exists and may not be replaced, or it is a folder.
        ExportError: its folder does not exist.
    """
    path = Path(path)
    if path.is_dir():
        raise UsageError(f"{path} is a folder; give the name of the cell file to write.")
    if path.exists() and not overwrite:
        raise UsageError(f"{path} exists; choose another name, or replace it with --overwrite.")
    if not path.resolve().parent.is_dir():
        raise ExportError(f"{path.parent} is no folder, so {path.name} cannot be written there; choose another place.")


def _append(table: Table, values: Mapping[str, TomlValue]) -> None:
    """Add keys behind the last one of a table, before the empty lines and comments that follow it."""
    if not values:
        return
    body = table.value.body
    last = max((index for index, (key, _) in enumerate(body) if key is not None), default=-1)
    before = body[last][1] if last >= 0 else table
    if not before.trivia.trail.endswith("\n"):
        before.trivia.trail += "\n"
    behind = body[last + 1 :]
    del body[last + 1 :]
    for key, value in values.items():
        table.append(key, _item(key, value))
    body.extend(behind)


def _item(key: str, value: TomlValue) -> Item:
    """Return a value as it is written: numbers short, a list that is too long for its line with an entry a line."""
    import tomlkit

    item = tomlkit.item(_shortened(value))
    if isinstance(value, str | float | int) or len(f"{key} = {item.as_string()}") <= LINE_LENGTH:
        return item
    lines = tomlkit.array()
    for entry in value:
        lines.add_line(_shortened(entry), indent="  ")
    lines.add_line(indent="")
    return lines


def _shortened(value: TomlValue) -> object:
    if isinstance(value, str):
        return value
    if isinstance(value, Sequence):
        return [_shortened(entry) for entry in value]
    number = round(float(value), DECIMALS)
    return int(number) if number.is_integer() else number


def _differs_only(old: str, new: str, *, table: str, values: Mapping[str, TomlValue | None]) -> bool:
    """Whether a text is still TOML and says the same but for the keys of one table."""
    try:
        before, after = tomllib.loads(old), tomllib.loads(new)
    except tomllib.TOMLDecodeError:
        return False
    wanted = {key for key, value in values.items() if value is not None}
    if {key for key in after[table] if key in values} != wanted:
        return False
    for parsed in (before, after):
        for key in values:
            parsed[table].pop(key, None)
    return before == after
