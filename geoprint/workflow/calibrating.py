"""Calibrate a cell: from what was touched to a cell file that says so, and how well it places a part."""

from __future__ import annotations

import os
import secrets
import tomllib
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias, cast

import numpy as np

from geoprint.config import cell_of, load_cell, packaged_cell_text
from geoprint.errors import ExportError, InputError, UsageError, VerificationError
from geoprint.geometry import prepare
from geoprint.geometry.files import load
from geoprint.model import Cell, FloatArray, Surface, TouchedPoints
from geoprint.results import CalibratedFixture, CalibratedTool, Suggestion
from geoprint.robot.placing import (
    FixtureCalibration,
    calibrate_fixture,
    calibrate_tip,
    next_touch,
    position_uncertainty,
    turn_uncertainty,
)
from geoprint.transforms import apply
from geoprint.workflow.number_tables import NamedPoints, read_flange_poses, read_points
from geoprint.workflow.workpiece import surface_uncertainty

if TYPE_CHECKING:
    from tomlkit.items import Item, Table


# Write values into a cell file and keep everything else of it: the other tables, their order, and the comments.
#
# tomlkit writes; the text is parsed again and must differ from the old one in the wanted keys alone.


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
            f"{name} has [{table}] in a form that cannot be edited alone: write that table with one plain key a line."
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


# A part may be touched where it reaches farthest along its axes and the diagonals between them.
OUTERMOST = np.array([axis for axis in product((-1.0, 0.0, 1.0), repeat=3) if any(axis)])


def calibrate(
    touched: Path | str | None,
    *,
    model: Path | str | None,
    tcp: Path | str | None,
    cell: Path | str | None,
    part: Path | str | None,
    unit: str | None,
    noise: float | None,
) -> CalibratedFixture | CalibratedTool:
    """Calibrate the fixture from touched and model points, or the tool from poses: whichever tables are given.

    Raises:
        UsageError: the tables of neither or of both are given, the cell is wrong, or its file cannot be edited.
        InputError: a table or mesh cannot be read, or its points or poses cannot be right.
    """
    if noise is not None and not 0.0 < noise < np.inf:
        raise UsageError(f"`--noise-mm` is {noise:g}; give the standard deviation of a touch in mm, above 0.")
    if tcp is not None and touched is None and model is None and part is None:
        return calibrate_tool(tcp, cell=cell, noise=noise)
    if tcp is None and touched is not None and model is not None:
        return calibrate_cell(touched, model=model, cell=cell, part=part, unit=unit, noise=noise)
    raise UsageError(
        "give a table of touched points and, with `--model`, that of the fixture's points; or `--tcp` alone, with a "
        "table of poses."
    )


def calibrate_cell(
    touched: Path | str,
    *,
    model: Path | str,
    cell: Path | str | None,
    part: Path | str | None,
    unit: str | None,
    noise: float | None,
) -> CalibratedFixture:
    """Find where the fixture stands from the points of it that the tool touched.

    Args:
        touched: table of touched points in the base frame.
        model: table of the fixture's points in its own frame; a name in both makes a pair, the others are candidates
            for the next touch.
        cell: the cell file, or None for the first packaged one.
        part: mesh of the part at which the uncertainty matters, or None.
        unit: of the mesh.
        noise: standard deviation of each coordinate of a touch [mm], or None to estimate it.

    Raises:
        UsageError: the cell is wrong, or its file cannot be edited.
        InputError: a table or mesh cannot be read, or the points cannot be right.
    """
    listed, found = read_points(model), read_points(touched)
    values = {
        "source": "calibrated",
        "model_mm": listed.places[_paired(listed, found)].tolist(),
        "touched_mm": found.places.tolist(),
        "noise_mm": noise,
    }
    before = load_cell(cell)
    text = edited(_text(cell), table="work", values=values, name=before.name)
    calibrated = cell_of(text, name=before.name, folder=_folder(cell))
    if calibrated.fixture is None:
        raise VerificationError(f"{before.name} does not read back as calibrated; please report this.")
    calibration = _calibration(calibrated.fixture, found)
    surface = None if part is None else prepare(load(part, unit=unit))[0]
    corners = _box_corners(calibration, surface)
    return CalibratedFixture(
        cell=calibrated,
        text=text,
        names=found.names,
        calibration=calibration,
        part=None if surface is None else surface.name,
        position=position_uncertainty(calibration, corners),
        turn=turn_uncertainty(calibration),
        surface=None if surface is None else surface_uncertainty(calibration, surface),
        suggestion=_suggestion(calibration, listed, surface, touched=found.names, corners=corners),
    )


def calibrate_tool(poses: Path | str, *, cell: Path | str | None, noise: float | None) -> CalibratedTool:
    """Find the tool centre point from poses in which the tip touched one fixed point.

    Args:
        poses: table of flange poses or joint angles.
        cell: the cell file, or None for the first packaged one.
        noise: standard deviation of each coordinate of a touch [mm], or None to estimate it.

    Raises:
        UsageError: the cell is wrong, or its file cannot be edited.
        InputError: the table cannot be read, or the poses do not determine the tip.
    """
    before = load_cell(cell)
    calibration = calibrate_tip(read_flange_poses(poses, robot=before.robot), noise=noise)
    text = edited(_text(cell), table="tool", values={"tcp_mm": calibration.tip.tolist()}, name=before.name)
    return CalibratedTool(
        cell_of(text, name=before.name, folder=_folder(cell)), text, calibration, before.tool.T_flange_tool[:3, 3]
    )


def save_calibrated(found: CalibratedFixture | CalibratedTool, out: Path | str, *, overwrite: bool) -> None:
    """Write the cell file and read it back.

    Raises:
        UsageError: the file exists and may not be replaced.
        ExportError: it cannot be written there.
        VerificationError: it does not read back as it was calibrated.
    """
    write_cell(out, found.text, overwrite=overwrite, verify=lambda path: _verify(load_cell(path), found.cell))


def _verify(written: Cell, wanted: Cell) -> None:
    same = np.array_equal(written.tool.T_flange_tool, wanted.tool.T_flange_tool)
    if written.fixture is not None and wanted.fixture is not None:
        same &= np.array_equal(written.fixture.model, wanted.fixture.model)
        same &= np.array_equal(written.fixture.touched, wanted.fixture.touched)
    if not same or (written.fixture is None) != (wanted.fixture is None):
        raise VerificationError(f"{wanted.name} does not read back as it was calibrated: write it again.")


def _folder(cell: Path | str | None) -> Path:
    """Return from where the files are found that a cell file names."""
    return Path() if cell is None else Path(cell).parent


def _text(cell: Path | str | None) -> str:
    """Return the text of a cell file that was just read, with its own line ends."""
    if cell is None:
        return packaged_cell_text(load_cell(None).name.removesuffix(".toml"))
    return Path(cell).read_bytes().decode("utf-8")


def _paired(listed: NamedPoints, found: NamedPoints) -> list[int]:
    """Return which listed point each touched one is.

    Raises:
        InputError: the list has a name twice, or lacks one that was touched.
    """
    twice = [name for name, times in Counter(listed.names).items() if times > 1]
    if twice:
        raise InputError(f"{listed.file} lists the point '{twice[0]}' twice: give each point its own name.")
    unknown = [name for name in found.names if name not in listed.names]
    if unknown:
        raise InputError(
            f"{found.file} has the point '{unknown[0]}', which {listed.file} does not list; there are: "
            f"{', '.join(listed.names[:20])}.",
            name=unknown[0],
        )
    return [listed.names.index(name) for name in found.names]


def _calibration(points: TouchedPoints, found: NamedPoints) -> FixtureCalibration:
    try:
        return calibrate_fixture(points)
    except InputError as error:
        numbered = ", ".join(f"{number} is {name}" for number, name in enumerate(found.names, start=1))
        raise InputError(f"{found.file}: {error} ({numbered})") from error


def _box_corners(calibration: FixtureCalibration, surface: Surface | None) -> FloatArray:
    """Return the (8, 3) corners, in the base frame, of the box about the part, or about the fixture's points."""
    placement = calibration.placement
    places = calibration.points.model if surface is None else surface.vertices
    corners = np.array([*product(*zip(places.min(axis=0), places.max(axis=0), strict=True))])
    return apply(placement.T_base_fixture if surface is None else placement.T_base_work, corners)


def _suggestion(
    calibration: FixtureCalibration,
    listed: NamedPoints,
    surface: Surface | None,
    *,
    touched: tuple[str, ...],
    corners: FloatArray,
) -> Suggestion:
    """Return the listed point, or the outermost point of the part, that helps most."""
    names, models = [*listed.names], [listed.places]
    if surface is not None:
        outermost = np.unique(np.argmax(surface.vertices @ OUTERMOST.T, axis=0))
        models.append(apply(calibration.placement.T_fixture_work, surface.vertices[outermost]))
        names += [surface.name] * len(outermost)
    model = np.concatenate(models)
    base = apply(calibration.placement.T_base_fixture, model)
    best, deviation, bound = next_touch(calibration, base, places=corners)
    return Suggestion(
        name=names[best],
        again=names[best] in touched,
        model=_triple(model[best]),
        base=_triple(base[best]),
        deviation=deviation,
        bound=bound,
    )


def _triple(place: FloatArray) -> tuple[float, float, float]:
    x, y, z = place.tolist()
    return x, y, z
