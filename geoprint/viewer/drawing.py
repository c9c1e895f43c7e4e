"""What is drawn on a part: places and lines of a job and of its field, kept in their files as they are drawn.

A drawing is what its job says: a source, outlines of patches, keep-outs, strokes and singularities of a field of
fibres. Each edit is written at once, so that nothing is lost whatever happens to the view, and can be undone.
"""

from __future__ import annotations

import csv
import io
import threading
import tomllib
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Final, NamedTuple, final

import numpy as np
from pydantic import ValidationError

from geoprint.config import FieldFile, Job, PatchRegion, read_field
from geoprint.config.job_file import edited_job_text, edited_toml, job_of
from geoprint.config.strict import describe, text_of
from geoprint.errors import GeoprintError, UsageError
from geoprint.geometry.files import write_whole
from geoprint.model import FloatArray
from geoprint.workflow.number_tables import read_points

# Decimals of places that are drawn [mm]: finer than any printer, and a file that a person can read.
DECIMALS: Final = 3
# How often lines turn around a singularity that is drawn: a whole turn.
INDEX: Final = 1.0
# What stands first in a field file that is drawn.
_FIELD_HEAD: Final = "# A field of fibres, drawn in `geoprint view`; `geoprint plan` follows it. Lengths in mm.\n"

# Keys that say which part is drawn on.
_OF_PART: Final = ("surface", "unit", "label", "threshold")

_Places = tuple[tuple[float, float, float], ...]


class Tool(NamedTuple):
    """What can be drawn.

    Attributes:
        name: in the list of tools.
        least: places that one needs.
        most: places that one can have; None for any number.
        closed: whether its line leads back to where it began.
        single: whether there is one at most, so that another one replaces it.
    """

    name: str
    least: int
    most: int | None = None
    closed: bool = False
    single: bool = False


POINT: Final = Tool("Source: point", 1, 1, single=True)
CURVE: Final = Tool("Source: curve", 2, single=True)
OUTLINE: Final = Tool("Patch outline", 3, closed=True)
KEEP_OUT: Final = Tool("Keep-out", 3, closed=True)
STROKE: Final = Tool("Stroke of fibres", 2)
SINGULARITY: Final = Tool("Singularity of fibres", 1, 1)
TOUCH: Final = Tool("Touch point", 1, 1)
# A patch that is bounded otherwise, and is kept in its place among those that are drawn.
BOUNDED: Final = Tool("Patch by other bounds", 0)
# What makes a field of fibres.
FIBRES: Final = frozenset({STROKE, SINGULARITY})
TOOLS: Final = (POINT, CURVE, OUTLINE, KEEP_OUT, STROKE, SINGULARITY, TOUCH)


class Item(NamedTuple):
    """One thing that is drawn.

    Attributes:
        tool: that draws it.
        places: in order [mm].
        rest: other keys of its table in the file, such as the weight of a stroke.
    """

    tool: Tool
    places: _Places
    rest: Mapping[str, object] = {}

    @property
    def complete(self) -> bool:
        """Whether it has the places that it needs; what has fewer is not in the files."""
        return len(self.places) >= self.tool.least

    @property
    def lists(self) -> list[list[float]]:
        """Its places, as files hold them."""
        return [[*place] for place in self.places]


class _State(NamedTuple):
    """A job as drawn: other keys, and items in the order of drawing."""

    job: Job
    items: tuple[Item, ...]


@final
class Drawing:
    """A job that is drawn, written to its file with each edit.

    Args:
        job: as it stands; files it names are seen from here.
        file: of the job, which the first edit writes. Field and touch points stand beside it.

    Attributes:
        file: of the job.
        lock: held during an edit.

    Raises:
        UsageError: files of the job cannot be read.
        InputError: as `UsageError`, of the table of touch points.
    """

    def __init__(self, job: Job, file: Path) -> None:
        self.file = file
        self._field_file = job.field or file.with_name(f"{file.stem}-field.toml")
        self._touch_file = file.with_name(f"{file.stem}-touch-points.csv")
        self._pattern = job.pattern if job.field is None else Job.model_fields["pattern"].default
        # What stands there is put back where nothing of a field is drawn any more.
        self._field_before = _bytes(self._field_file)
        # Edits come from several threads.
        self.lock = threading.RLock()
        self._states = [_State(job, tuple(self._read(job)))]
        self._filed = self._contents()

    @property
    def job(self) -> Job:
        """The job as drawn."""
        return self._states[-1].job

    @property
    def items(self) -> tuple[Item, ...]:
        """What is drawn, in the order of drawing."""
        return self._states[-1].items

    @property
    def edits(self) -> int:
        """How many edits can be undone."""
        return len(self._states) - 1

    @property
    def drawn(self) -> list[int]:
        """Numbers of the items that are drawn, among all."""
        return [number for number, item in enumerate(self.items) if item.tool is not BOUNDED]

    def add(self, tool: Tool, place: FloatArray, *, begins: bool = False) -> None:
        """Add a place to the item that is drawn last with a tool.

        Args:
            tool: that draws.
            place: (3,) on the part [mm].
            begins: whether another item begins there; one that has all of its places, or another tool, does so anyhow.

        Raises:
            UsageError: the job cannot be as drawn, and nothing has changed; or its files were edited meanwhile, and
                what they say now is the job.
            ExportError: a file cannot be written.
        """
        with self.lock:
            items = [item for item in self.items if item.complete or item.tool is tool]
            last = items[-1] if items and items[-1].tool is tool else None
            if last is None or begins or len(last.places) == tool.most:
                if tool.single:
                    items = [item for item in items if not item.tool.single]
                self._keep(items=[*items, Item(tool, (_rounded(place),))])
            else:
                self._keep(items=[*items[:-1], last._replace(places=(*last.places, _rounded(place)))])

    def moved(self, item: int, point: int, place: FloatArray) -> Job:
        """Return the job with a place of an item elsewhere, without keeping it.

        Raises:
            UsageError: the job cannot be so.
        """
        return self._job(self._with(item, point, place))

    def move(self, item: int, point: int, place: FloatArray) -> None:
        """Move a place of an item; errors as of `add`."""
        with self.lock:
            self._keep(items=self._with(item, point, place))

    def remove(self, item: int) -> None:
        """Remove an item; errors as of `add`."""
        with self.lock:
            self._keep(items=[one for number, one in enumerate(self.items) if number != item])

    def change(self, **keys: object) -> None:
        """Set keys of the job that are not drawn; errors as of `add`."""
        with self.lock:
            gone = "source" in keys
            items = [one for one in self.items if not (gone and one.tool.single)]
            self._keep(items=items, keys=keys)

    def undo(self) -> bool:
        """Take the last edit back, in the files too; False where there is none.

        Raises:
            UsageError: the files were edited meanwhile, and what they say now is the job.
            ExportError: a file cannot be written.
        """
        with self.lock:
            self._take_over()
            if not self.edits:
                return False
            undone = self._states.pop()
            try:
                self._write()
            except BaseException:
                self._states.append(undone)
                raise
            return True

    def _with(self, item: int, point: int, place: FloatArray) -> list[Item]:
        items = [*self.items]
        places = [*items[item].places]
        places[point] = _rounded(place)
        items[item] = items[item]._replace(places=tuple(places))
        return items

    def _take_over(self) -> None:
        """Take over what someone else wrote into the files, and refuse the edit that would have replaced it."""
        if self._contents() == self._filed:
            return
        job = job_of(surface=self.file)
        if any(getattr(job, key) != getattr(self.job, key) for key in _OF_PART):
            raise UsageError(f"{self.file.name} names another part now: close this view, and open the file again.")
        # What was drawn before belongs to files as they were: it is not put back over what someone else wrote.
        self._field_file = job.field or self._field_file
        self._field_before = _bytes(self._field_file)
        self._states = [_State(job, tuple(self._read(job)))]
        self._filed = self._contents()
        raise UsageError(
            f"{self.file.name} was edited elsewhere: what it says now is shown. Make this edit again, if it is still "
            "wanted."
        )

    def _contents(self) -> list[bytes | None]:
        return [_bytes(file) for file in (self.file, self._field_file, self._touch_file)]

    def _keep(self, *, items: Sequence[Item], keys: Mapping[str, object] | None = None) -> None:
        self._take_over()
        self._states.append(_State(self._job(items, keys), tuple(items)))
        try:
            self._write()
        except BaseException:
            self._states.pop()
            with suppress(GeoprintError):
                self._write()
            raise

    def _job(self, items: Sequence[Item], keys: Mapping[str, object] | None = None) -> Job:
        """Return the job with such items in it, and other keys."""
        drawn = [item for item in items if item.complete]
        job, keys = self.job, keys or {}
        values: dict[str, object] = {**dict(job), **keys}
        values["keep_outs"] = [item.lists for item in drawn if item.tool is KEEP_OUT]
        sources = [item for item in drawn if item.tool.single]
        if sources:
            values["source"] = _source(sources[-1])
        elif "source" not in keys and any(item.tool.single for item in self.items):
            values["source"] = None
        before = [item for item in self.items if item.complete]
        drew, draws = (any(item.tool in FIBRES for item in some) for some in (before, drawn))
        if draws and not drew:
            values |= {"pattern": "fibres", "field": self._field_file}
        elif drew and not draws and not self._others_in_field():
            values |= {"pattern": self._pattern, "field": None}
        try:
            values["patches"] = [
                PatchRegion.model_validate({**item.rest, "curve": item.lists or None})
                for item in drawn
                if item.tool in {OUTLINE, BOUNDED}
            ]
            return Job.model_validate(values)
        except ValidationError as error:
            raise UsageError(f"{describe(error)}.") from error

    def _write(self) -> None:
        items = [item for item in self.items if item.complete]
        strokes = [{"stroke": item.lists, **item.rest} for item in items if item.tool is STROKE]
        turns = [{"place": item.lists[0], "index": INDEX, **item.rest} for item in items if item.tool is SINGULARITY]
        if self.job.field is not None:
            text = text_of(self._field_file) if self._field_file.is_file() else _FIELD_HEAD
            kept = tomllib.loads(text).get("preferences", [])
            leant = [*(one for one in kept if "stroke" not in one), *strokes]
            text = edited_toml(text, {"preferences": leant or None, "singularities": turns or None})
            _check_field(text, self._field_file.name)
            write_whole(self._field_file, text.encode())
        elif self._field_before is not None:
            write_whole(self._field_file, self._field_before)
        else:
            self._field_file.unlink(missing_ok=True)
        touched = [item for item in items if item.tool is TOUCH]
        if touched or self._touch_file.is_file():
            write_whole(self._touch_file, _table(touched))
        write_whole(self.file, edited_job_text(self.job, self.file).encode())
        self._filed = self._contents()

    def _others_in_field(self) -> bool:
        """Return whether the field file says more of lines than what is drawn."""
        if not self._field_file.is_file():
            return False
        field = read_field(self._field_file)
        leant = any(one.stroke is None for one in field.preferences)
        return leant or field.helix is not None or field.wall is not None

    def _read(self, job: Job) -> list[Item]:
        """Return what the files say of what can be drawn."""
        items = [
            Item(
                BOUNDED if region.curve is None else OUTLINE,
                _tuples(region.curve or ()),
                {key: value for key, value in region if key != "curve" and value is not None},
            )
            for region in job.patches
        ]
        items += [Item(KEEP_OUT, _tuples(curve)) for curve in job.keep_outs]
        if job.source is not None and job.source.point is not None:
            items.append(Item(POINT, _tuples([job.source.point])))
        if job.source is not None and job.source.curve is not None:
            items.append(Item(CURVE, _tuples(job.source.curve)))
        if job.field is not None:
            field = read_field(job.field)
            items += [
                Item(STROKE, _tuples(one.stroke), {} if one.weight is None else {"weight": one.weight})
                for one in field.preferences
                if one.stroke is not None
            ]
            items += [
                Item(SINGULARITY, _tuples([one.place]), {} if one.index == INDEX else {"index": one.index})
                for one in field.singularities
            ]
        if self._touch_file.is_file():
            touched = read_points(self._touch_file)
            named = zip(touched.names, touched.places.tolist(), strict=True)
            items += [Item(TOUCH, _tuples([place]), {"name": name}) for name, place in named]
        return items


def _bytes(file: Path) -> bytes | None:
    return file.read_bytes() if file.is_file() else None


def _check_field(text: str, name: str) -> None:
    """Refuse a field that says nothing, or contradicts itself.

    Raises:
        UsageError: it does.
    """
    try:
        FieldFile.model_validate(tomllib.loads(text))
    except ValidationError as error:
        raise UsageError(f"{name}: {describe(error, kind=FieldFile)}.") from error


def _source(item: Item) -> dict[str, object]:
    return {"point": item.lists[0]} if item.tool is POINT else {"curve": item.lists}


def _rounded(place: FloatArray) -> tuple[float, float, float]:
    x, y, z = np.round(place, DECIMALS).tolist()
    return x, y, z


def _tuples(places: Sequence[Sequence[float]]) -> _Places:
    return tuple((x, y, z) for x, y, z in places)


def _table(touched: Sequence[Item]) -> bytes:
    """Return places as the table of points that `geoprint calibrate --model` takes."""
    text = io.StringIO()
    rows = csv.writer(text, lineterminator="\n")
    rows.writerow(("name", "x", "y", "z"))
    rows.writerows((item.rest.get("name", f"p{number}"), *item.places[0]) for number, item in enumerate(touched, 1))
    return text.getvalue().encode()
