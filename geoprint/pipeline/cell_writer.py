"""Write values into a cell file and keep everything else of it: the other tables, their order, and the comments.

A TOML text is a row of statements: a header, a key with its value, a comment or an empty line. `tomllib` itself says
where each ends, because only a whole statement parses. The edited text is parsed again and must differ from the old
one in the wanted keys alone.
"""

from __future__ import annotations

import json
import os
import secrets
import tomllib
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from io import StringIO
from itertools import pairwise
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TypeAlias

from geoprint.config import load_cell
from geoprint.errors import ExportError, UsageError, VerificationError
from geoprint.model import Cell

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
        UsageError: the table has no header of its own, or the text is laid out in a way that cannot be edited safely.

    Examples:
        >>> text = "[work]  # here\nsource = 'demo'  # so far"
        >>> edited(text, table="work", values={"source": "x", "rms": 0.1}, name="a.toml").splitlines()
        ['[work]  # here', 'source = "x"  # so far', 'rms = 0.1']
    """
    before = tomllib.loads(text)
    newline = "\r\n" if "\r\n" in text else "\n"
    lines = {key: "" if value is None else _assignment(key, value, newline) for key, value in values.items()}
    statements = _statements(text)
    missing, body = dict(lines), _body(statements, table=table, name=name)
    last = body.start - 1
    for index in body:
        parsed = tomllib.loads(statements[index])
        for key in parsed:
            last = index
            line = missing.pop(key, None)
            if line is not None:
                statements[index] = f"{line}{_comment(statements[index], parsed)}{newline}" if line else ""
    added = [f"{line}{newline}" for line in missing.values() if line]
    if added and statements[last] and not statements[last].endswith("\n"):
        added.insert(0, newline)
    statements[last] += "".join(added)
    result = "".join(statements)
    kept = {key: value for key, value in before[table].items() if key not in values}
    wanted = {**before, table: {**kept, **tomllib.loads(newline.join(lines.values()))}}
    if not _parses_as(result, wanted):
        raise UsageError(
            f"{name} cannot be edited without changing more than [{table}]: write that table with one plain key a line."
        )
    return result


def loaded(text: str, *, name: str) -> Cell:
    """Return the cell of a text, read as every cell file is.

    Raises:
        UsageError: a key is unknown, missing or meaningless.
    """
    with TemporaryDirectory() as folder:
        path = Path(folder) / name
        path.write_bytes(text.encode("utf-8"))
        return load_cell(path)


def write_cell(path: Path, text: str, *, overwrite: bool, verify: Callable[[Path], None]) -> None:
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
    place = path.resolve()
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


def check_cell_writable(path: Path, *, overwrite: bool) -> None:
    """Check that a cell file may stand somewhere, before any work.

    Raises:
        UsageError: the file exists and may not be replaced, or it is a folder.
        ExportError: its folder does not exist.
    """
    if path.is_dir():
        raise UsageError(f"{path} is a folder; give the name of the cell file to write.")
    if path.exists() and not overwrite:
        raise UsageError(f"{path} exists; choose another name, or replace it with --overwrite.")
    if not path.resolve().parent.is_dir():
        raise ExportError(f"{path.parent} is no folder, so {path.name} cannot be written there; choose another place.")


def _statements(text: str) -> list[str]:
    """Return the statements of a valid TOML text, each with its line ends; joined they are the text."""
    statements: list[str] = []
    pending = ""
    for line in StringIO(text, newline="\n"):
        pending += line
        try:
            tomllib.loads(pending)
        except tomllib.TOMLDecodeError:
            continue
        statements.append(pending)
        pending = ""
    return statements


def _body(statements: Sequence[str], *, table: str, name: str) -> range:
    """Return which statements stand between a table's header and the next one."""
    headers = [index for index, statement in enumerate(statements) if statement.lstrip().startswith("[")]
    for index, after in pairwise([*headers, len(statements)]):
        if tomllib.loads(statements[index]) == {table: {}}:
            return range(index + 1, after)
    raise UsageError(f"{name} has no table [{table}] with a header of its own; write one as in `geoprint init`.")


def _comment(statement: str, parsed: Mapping[str, object]) -> str:
    """Return the comment behind a value with the space before it, or nothing."""
    for index, character in enumerate(statement):
        if character == "#" and _parses_as(statement[:index], parsed):
            bare = statement[:index].rstrip()
            return statement[len(bare) :].rstrip()
    return ""


def _parses_as(text: str, parsed: Mapping[str, object]) -> bool:
    try:
        return tomllib.loads(text) == parsed
    except tomllib.TOMLDecodeError:
        return False


def _assignment(key: str, value: TomlValue, newline: str) -> str:
    line = f"{key} = {_literal(value)}"
    if len(line) <= LINE_LENGTH or isinstance(value, str | float | int):
        return line
    entries = "".join(f"  {_literal(entry)},{newline}" for entry in value)
    return f"{key} = [{newline}{entries}]"


def _literal(value: TomlValue) -> str:
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, float | int):
        # Without a negative zero.
        return f"{round(value, DECIMALS) + 0.0:.{DECIMALS}f}".rstrip("0").removesuffix(".")
    return f"[{', '.join(_literal(entry) for entry in value)}]"
