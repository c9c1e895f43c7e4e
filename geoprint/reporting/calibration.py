"""What is said of a calibration, to a person and as JSON."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any, cast

import numpy as np
from scipy.spatial.transform import Rotation

from geoprint.errors import how_many
from geoprint.model import DECIMALS, Rounded
from geoprint.postprocessor import Json
from geoprint.reporting.records.rounding import Record, as_json
from geoprint.reporting.tables import marked_lines
from geoprint.results import CalibratedFixture, CalibratedTool, Suggestion
from geoprint.robot.placing import NOTABLE_SHARE, TouchStatistics, Uncertainty

# What is said of a calibration as figures: the object for programs.


Numbers = tuple[Rounded, ...]


class TouchRecord(Record):
    """One touch: its residual, how far it is from where the others put it, and whether chance explains that."""

    name: str
    residual_mm: Numbers
    miss_mm: Rounded
    chance: Rounded
    odd: bool


class TouchesRecord(Record):
    """All touches: their residuals' root mean square, and the noise of one with its interval in 95 of 100."""

    rms_mm: Rounded
    noise_mm: Rounded
    noise_given: bool
    noise_between_mm: Numbers
    chance_of_residuals: Rounded | None
    points: tuple[TouchRecord, ...]


class UncertaintyRecord(Record):
    """How far off a place may be along a direction: standard deviation, and bound in 95 of 100 calibrations."""

    deviation_mm: Rounded
    within_mm: Rounded
    at_mm: Numbers
    along: Numbers


class AttitudeRecord(Record):
    """How far the fixture may be turned about an axis: standard deviation, and bound in 95 of 100 calibrations."""

    deviation_deg: Rounded
    within_deg: Rounded
    about: Numbers


class SurfaceUncertaintyRecord(Record):
    """An uncertainty along the part's normal, and whether a plan refuses it or warns at this stand-off."""

    deviation_mm: Rounded
    within_mm: Rounded
    at_mm: Numbers
    along: Numbers
    standoff_mm: float
    refused: bool
    warned: bool


class FixtureRecord(Record):
    """What is said of a touched fixture; the fields, those of `touches` among them, are the keys of `--json`.

    Fixture and part stand in the base frame, as the rows of their matrices, the part as the cell states it. The
    covariance is that of the shift [mm] and the turn [rad] about the centre of the points, along and about the base's
    axes. The position is known worst at one corner of the box about the part, or without one about the fixture's
    points; the surface of a part along its normal where that is largest.
    """

    cell: str
    part: str | None
    part_stated: bool
    T_base_fixture: tuple[Numbers, ...]
    T_base_work: tuple[Numbers, ...]
    touches: TouchesRecord
    centre_mm: Numbers
    covariance_mm_rad: tuple[tuple[float, ...], ...]
    position: UncertaintyRecord
    attitude: AttitudeRecord
    surface: SurfaceUncertaintyRecord | None
    touch_next: Suggestion


class ToolRecord(Record):
    """What is said of a touched tool; the fields, those of `touches` among them, are the keys of `--json`.

    The tip as found, as the cell had it and how far it may be off along its worst direction in the flange frame; the
    point that was touched in the base frame; and whether the cell's fixture was touched with the old tip.
    """

    cell: str
    tcp_mm: Numbers
    before_mm: Numbers
    touched_mm: Numbers
    touches: TouchesRecord
    deviation_mm: Rounded
    along: Numbers
    within_mm: Rounded
    fixture_outdated: bool


def calibration_summary(found: CalibratedFixture | CalibratedTool) -> dict[str, Json]:
    """Return a calibration as `--json` prints it."""
    record = as_json(fixture_record(found) if isinstance(found, CalibratedFixture) else tool_record(found))
    # The figures of the touches stand beside the others.
    parts = (value if key == "touches" else {key: value} for key, value in record.items())
    return {key: value for part in parts for key, value in cast("dict[str, Json]", part).items()}


def fixture_record(found: CalibratedFixture) -> FixtureRecord:
    """Return what is said of a touched fixture."""
    calibration = found.calibration
    return FixtureRecord.of(
        calibration.placement,
        cell=found.cell.name,
        part=found.part,
        touches=_touches_record(calibration.statistics, found.names),
        centre_mm=calibration.centre,
        covariance_mm_rad=calibration.covariance.round(2 * DECIMALS),
        position=UncertaintyRecord.of(found.position, **_uncertainty(found.position)),
        attitude=AttitudeRecord.of(
            found.turn, within_deg=float(np.degrees(found.turn.bound)), about=found.turn.direction
        ),
        surface=_surface_record(found.surface, standoff=found.cell.process.standoff),
        touch_next=found.suggestion,
    )


def _surface_record(surface: Uncertainty | None, *, standoff: float) -> SurfaceUncertaintyRecord | None:
    """Say what the calibration means for printing, by the rule that the plan applies."""
    if surface is None:
        return None
    return SurfaceUncertaintyRecord.of(
        surface,
        **_uncertainty(surface),
        standoff_mm=standoff,
        refused=surface.bound > standoff,
        warned=surface.bound > NOTABLE_SHARE * standoff,
    )


def tool_record(found: CalibratedTool) -> ToolRecord:
    """Return what is said of a touched tool."""
    calibration = found.calibration
    return ToolRecord.of(
        calibration,
        cell=found.cell.name,
        tcp_mm=calibration.tip,
        before_mm=found.before,
        touches=_touches_record(calibration.statistics, pose_names(calibration.statistics)),
        along=calibration.direction,
        within_mm=calibration.bound,
        fixture_outdated=found.cell.fixture is not None,
    )


def _touches_record(statistics: TouchStatistics, names: tuple[str, ...]) -> TouchesRecord:
    noise = statistics.noise
    return TouchesRecord.of(
        statistics,
        noise_mm=noise.deviation,
        noise_given=noise.given,
        noise_between_mm=noise.interval,
        chance_of_residuals=statistics.excess,
        points=tuple(
            TouchRecord(
                name=name,
                residual_mm=tuple(statistics.residuals[k].tolist()),
                miss_mm=float(statistics.misses[k]),
                chance=float(statistics.chances[k]),
                odd=k in statistics.odd,
            )
            for k, name in enumerate(names)
        ),
    )


def pose_names(statistics: TouchStatistics) -> tuple[str, ...]:
    """Return what the poses of a touched tool are called: their numbers."""
    return tuple(str(number) for number in range(1, len(statistics.residuals) + 1))


def _uncertainty(found: Uncertainty) -> dict[str, Any]:
    """Return the fields of a record of an uncertainty that have other names."""
    return {"within_mm": found.bound, "at_mm": found.place, "along": found.direction}


# What a person reads of a calibration.


def calibration_text(found: CalibratedFixture | CalibratedTool, *, width: int | None = None) -> str:
    """Return the lines that a person reads of a calibration.

    Args:
        found: the calibration.
        width: letters in a line, where they are counted; the table of touches leaves columns out that do not fit.
    """
    fixture = isinstance(found, CalibratedFixture)
    return "\n".join(_fixture_lines(found, width=width) if fixture else _tool_lines(found, width=width))


def _fixture_lines(found: CalibratedFixture, *, width: int | None) -> Iterator[str]:
    record = fixture_record(found)
    # Angles from the matrix itself: six decimals of it are too few for three of a degree.
    rpy = Rotation.from_matrix(found.calibration.placement.T_base_fixture[:3, :3]).as_euler("xyz", degrees=True)
    position, turn, following = record.position, record.attitude, record.touch_next
    yield (
        f"fixture: at ({_listed((row[3] for row in record.T_base_fixture[:3]), 3)}) mm, roll, pitch, yaw "
        f"({_listed(rpy.tolist(), 3)}) degrees in the base frame, from {how_many(len(found.names), 'touched point')}"
    )
    yield _noise_line(record.touches)
    yield from _touch_lines(record.touches, what="point", width=width)
    where = record.part or "the fixture's points"
    yield (
        f"position, worst corner of the box around {where}: {position.deviation_mm:.3f} mm (standard deviation) along "
        f"({_listed(position.along, 2)}) at ({_listed(position.at_mm, 1)}); within {position.within_mm:.3f} mm in 95 "
        "of 100 calibrations"
    )
    yield (
        f"attitude, worst axis: {turn.deviation_deg:.3f} degrees about ({_listed(turn.about, 2)}); within "
        f"{turn.within_deg:.3f} degrees in 95 of 100"
    )
    if record.surface is not None:
        yield _surface_line(record.surface)
    yield (
        f"touch next: {following.name}{' again' if following.again else ''}, at ({_listed(following.model, 1)}) "
        f"mm in the fixture's frame, ({_listed(following.base, 1)}) in the base frame; it leaves "
        f"{following.deviation:.3f} mm at worst, within {following.bound:.3f} mm"
    )
    stated = (
        f"{record.cell} does not state where the part stands on the fixture: add part_mm under [work] (and "
        "part_rpy_deg if it is turned). Until then, programs only run dry, with the part's origin at the fixture's."
    )
    yield from _mind(found.calibration.statistics, found.names, [] if record.part_stated else [stated])


def _tool_lines(found: CalibratedTool, *, width: int | None) -> Iterator[str]:
    record, calibration = tool_record(found), found.calibration
    yield (
        f"tool centre point: ({_listed(record.tcp_mm, 3)}) mm in the flange frame, from "
        f"{how_many(len(record.touches.points), 'pose')}; {np.linalg.norm(calibration.tip - found.before):.3f} mm "
        "from the cell's old value"
    )
    yield _noise_line(record.touches)
    yield from _touch_lines(record.touches, what="pose", width=width)
    yield (
        f"uncertainty: at worst {record.deviation_mm:.3f} mm (standard deviation) along ({_listed(record.along, 2)}) "
        f"of the flange; within {record.within_mm:.3f} mm in 95 of 100 calibrations"
    )
    outdated = "the cell's touched points were read with the old tool centre point: touch them again."
    names = pose_names(calibration.statistics)
    yield from _mind(calibration.statistics, names, [outdated] if record.fixture_outdated else [])


def _noise_line(touches: TouchesRecord) -> str:
    low, high = touches.noise_between_mm
    record = "as given" if touches.noise_given else f"estimated; between {low:.3f} and {high:.3f} in 95 of 100"
    return f"RMS {touches.rms_mm:.3f} mm; noise of a touch in each direction: {touches.noise_mm:.3f} mm ({record})"


def _touch_lines(touches: TouchesRecord, *, what: str, width: int | None) -> Iterator[str]:
    """Return the table of touches; where it does not fit, without the directions of the residuals."""
    names = max(len(what), *(len(touch.name) for touch in touches.points))
    full = [_touch_line(touch, names=names, directed=True) for touch in touches.points]
    directed = width is None or max(map(len, full)) <= width
    yield "residual of each touch, its length, and its distance from the fit of the others [mm]:"
    axes = "      x       y       z  " if directed else ""
    yield f"  {what:<{names}}  {axes}length  others"
    yield from full if directed else (_touch_line(touch, names=names, directed=False) for touch in touches.points)


def _touch_line(touch: TouchRecord, *, names: int, directed: bool) -> str:
    x, y, z = touch.residual_mm
    direction = f"{x:7.3f} {y:7.3f} {z:7.3f}  " if directed else ""
    length = float(np.linalg.norm(touch.residual_mm))
    return f"  {touch.name:<{names}}  {direction}{length:6.3f}  {touch.miss_mm:6.3f}{'  ODD' if touch.odd else ''}"


def _surface_line(surface: SurfaceUncertaintyRecord) -> str:
    verdict = "plans will carry a warning" if surface.warned else "good enough"
    if surface.refused:
        verdict = "too much: plans will be refused"
    return (
        f"surface: along its normal within {surface.within_mm:.3f} mm in 95 of 100, worst at "
        f"({_listed(surface.at_mm, 1)}); the stand-off is {surface.standoff_mm:g} mm: {verdict}"
    )


def _mind(statistics: TouchStatistics, names: tuple[str, ...], warnings: list[str]) -> list[str]:
    """Return the given warnings and what the touches themselves warn of, then notes."""
    if statistics.odd:
        odd = ", ".join(names[k] for k in statistics.odd)
        which = "one of these" if len(statistics.odd) > 1 else "this"
        warnings = [
            *warnings,
            f"{odd}: by chance a good touch looks this odd in fewer than 1 of 100 calibrations; touch {which} again.",
        ]
    estimated = (
        "the residuals exceed the given noise (by chance in fewer than 1 of 100 calibrations), so the noise is "
        "estimated from them."
    )
    surprising = statistics.excess is not None and not statistics.noise.given
    return marked_lines(warnings=warnings, notes=[estimated] if surprising else [])


def _listed(values: Iterable[float], decimals: int) -> str:
    return ", ".join(f"{value:z.{decimals}f}" for value in values)
