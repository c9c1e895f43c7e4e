"""What is said of a calibration as figures: the object for programs."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass
from typing import final

import numpy as np

from geoprint.account.records.rounding import DECIMALS, rounded
from geoprint.export import Json
from geoprint.model import FloatArray
from geoprint.motion.placing import NOTABLE_SHARE, TouchStatistics, Uncertainty
from geoprint.results import CalibratedFixture, CalibratedTool

Numbers = tuple[float, ...]


@final
@dataclass(frozen=True, slots=True)
class TouchRecord:
    """One touch: its residual, how far it is from where the others put it, and whether chance explains that."""

    name: str
    residual_mm: Numbers
    miss_mm: float
    chance: float
    odd: bool


@final
@dataclass(frozen=True, slots=True)
class TouchesRecord:
    """All touches: their residuals' root mean square, and the noise of one with its interval in 95 of 100."""

    rms_mm: float
    noise_mm: float
    noise_given: bool
    noise_between_mm: Numbers
    chance_of_residuals: float | None
    points: tuple[TouchRecord, ...]


@final
@dataclass(frozen=True, slots=True)
class UncertaintyRecord:
    """How far off a place may be along a direction: standard deviation, and bound in 95 of 100 calibrations."""

    deviation_mm: float
    within_mm: float
    at_mm: Numbers
    along: Numbers


@final
@dataclass(frozen=True, slots=True)
class AttitudeRecord:
    """How far the fixture may be turned about an axis: standard deviation, and bound in 95 of 100 calibrations."""

    deviation_deg: float
    within_deg: float
    about: Numbers


@final
@dataclass(frozen=True, slots=True)
class SurfaceUncertaintyRecord:
    """An uncertainty along the part's normal, and whether a plan refuses it or warns at this stand-off."""

    deviation_mm: float
    within_mm: float
    at_mm: Numbers
    along: Numbers
    standoff_mm: float
    refused: bool
    warned: bool


@final
@dataclass(frozen=True, slots=True)
class NextTouchRecord:
    """What to touch next, where it is in the fixture's and in the base frame, and what uncertainty it leaves."""

    name: str
    again: bool
    fixture_mm: Numbers
    base_mm: Numbers
    deviation_mm: float
    within_mm: float


@final
@dataclass(frozen=True, slots=True)
class FixtureRecord:
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
    covariance_mm_rad: tuple[Numbers, ...]
    position: UncertaintyRecord
    attitude: AttitudeRecord
    surface: SurfaceUncertaintyRecord | None
    touch_next: NextTouchRecord


@final
@dataclass(frozen=True, slots=True)
class ToolRecord:
    """What is said of a touched tool; the fields, those of `touches` among them, are the keys of `--json`.

    The tip as found, as the cell had it and how far it may be off along its worst direction in the flange frame; the
    point that was touched in the base frame; and whether the cell's fixture was touched with the old tip.
    """

    cell: str
    tcp_mm: Numbers
    before_mm: Numbers
    touched_mm: Numbers
    touches: TouchesRecord
    deviation_mm: float
    along: Numbers
    within_mm: float
    fixture_outdated: bool


def calibration_summary(found: CalibratedFixture | CalibratedTool) -> dict[str, Json]:
    """Return a calibration as `--json` prints it."""
    told = asdict(fixture_record(found) if isinstance(found, CalibratedFixture) else tool_record(found))
    # The figures of the touches stand beside the others.
    parts = (value if key == "touches" else {key: value} for key, value in told.items())
    return {key: value for part in parts for key, value in part.items()}


def fixture_record(found: CalibratedFixture) -> FixtureRecord:
    """Return what is said of a touched fixture."""
    calibration, following = found.calibration, found.suggestion
    placement = calibration.placement
    return FixtureRecord(
        cell=found.cell.name,
        part=found.part,
        part_stated=placement.part_stated,
        T_base_fixture=_rows(placement.T_base_fixture),
        T_base_work=_rows(placement.T_base_work),
        touches=_touches_record(calibration.statistics, found.names),
        centre_mm=_numbers(calibration.centre),
        covariance_mm_rad=tuple(map(tuple, calibration.covariance.round(2 * DECIMALS).tolist())),
        position=UncertaintyRecord(*_uncertainty(found.position)),
        attitude=AttitudeRecord(
            deviation_deg=rounded(np.degrees(found.turn.deviation)),
            within_deg=rounded(np.degrees(found.turn.bound)),
            about=_numbers(found.turn.direction),
        ),
        surface=_surface_record(found.surface, standoff=found.cell.process.standoff),
        touch_next=NextTouchRecord(
            name=following.name,
            again=following.again,
            fixture_mm=_numbers(following.model),
            base_mm=_numbers(following.base),
            deviation_mm=rounded(following.deviation),
            within_mm=rounded(following.bound),
        ),
    )


def _surface_record(surface: Uncertainty | None, *, standoff: float) -> SurfaceUncertaintyRecord | None:
    """Say what the calibration means for printing, by the rule that the plan applies."""
    if surface is None:
        return None
    return SurfaceUncertaintyRecord(
        *_uncertainty(surface),
        standoff_mm=standoff,
        refused=surface.bound > standoff,
        warned=surface.bound > NOTABLE_SHARE * standoff,
    )


def tool_record(found: CalibratedTool) -> ToolRecord:
    """Return what is said of a touched tool."""
    calibration = found.calibration
    return ToolRecord(
        cell=found.cell.name,
        tcp_mm=_numbers(calibration.tip),
        before_mm=_numbers(found.before),
        touched_mm=_numbers(calibration.touched),
        touches=_touches_record(calibration.statistics, pose_names(calibration.statistics)),
        deviation_mm=rounded(calibration.deviation),
        along=_numbers(calibration.direction),
        within_mm=rounded(calibration.bound),
        fixture_outdated=found.cell.fixture is not None,
    )


def _touches_record(statistics: TouchStatistics, names: tuple[str, ...]) -> TouchesRecord:
    noise = statistics.noise
    return TouchesRecord(
        rms_mm=rounded(statistics.rms),
        noise_mm=rounded(noise.deviation),
        noise_given=noise.given,
        noise_between_mm=_numbers(noise.interval),
        chance_of_residuals=None if statistics.excess is None else rounded(statistics.excess),
        points=tuple(
            TouchRecord(
                name=name,
                residual_mm=_numbers(statistics.residuals[k]),
                miss_mm=rounded(statistics.misses[k]),
                chance=rounded(statistics.chances[k]),
                odd=k in statistics.odd,
            )
            for k, name in enumerate(names)
        ),
    )


def pose_names(statistics: TouchStatistics) -> tuple[str, ...]:
    """Return what the poses of a touched tool are called: their numbers."""
    return tuple(str(number) for number in range(1, len(statistics.residuals) + 1))


def _uncertainty(found: Uncertainty) -> tuple[float, float, Numbers, Numbers]:
    """Return the fields of an `UncertaintyRecord`."""
    return rounded(found.deviation), rounded(found.bound), _numbers(found.place), _numbers(found.direction)


def _rows(matrix: FloatArray) -> tuple[Numbers, ...]:
    return tuple(_numbers(row) for row in matrix)


def _numbers(values: Iterable[float]) -> Numbers:
    return tuple(map(rounded, values))
