"""What a person reads of a calibration."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np
from scipy.spatial.transform import Rotation

from geoprint.account.calibration import (
    SurfaceUncertaintyRecord,
    TouchesRecord,
    TouchRecord,
    fixture_record,
    pose_names,
    tool_record,
)
from geoprint.account.texts.marks import marked_lines
from geoprint.motion.placing import TouchStatistics
from geoprint.results import CalibratedFixture, CalibratedTool


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
        f"({_listed(rpy.tolist(), 3)}) degrees in the base frame, from {len(found.names)} touched points"
    )
    yield _noise_line(record.touches)
    yield from _touch_lines(record.touches, what="point", width=width)
    where = record.part or "the fixture's points"
    yield (
        f"position: at the corners of the box about {where} at worst "
        f"{position.deviation_mm:.3f} mm (standard deviation) along ({_listed(position.along, 2)}) at "
        f"({_listed(position.at_mm, 1)}); within {position.within_mm:.3f} mm in 95 of 100 calibrations"
    )
    yield (
        f"attitude: at worst {turn.deviation_deg:.3f} degrees about ({_listed(turn.about, 2)}); within "
        f"{turn.within_deg:.3f} degrees in 95 of 100"
    )
    if record.surface is not None:
        yield _surface_line(record.surface)
    yield (
        f"touch next: {following.name}{' again' if following.again else ''}, at ({_listed(following.fixture_mm, 1)}) "
        f"mm in the fixture's frame, ({_listed(following.base_mm, 1)}) in the base frame; it leaves "
        f"{following.deviation_mm:.3f} mm at worst, within {following.within_mm:.3f} mm"
    )
    stated = (
        f"{record.cell} does not state where the part stands on the fixture: write part_mm under [work] (and "
        "part_rpy_deg where the part's axes are turned). Until then programs run only dry, with the part's origin at "
        "the fixture's."
    )
    yield from _mind(found.calibration.statistics, found.names, [] if record.part_stated else [stated])


def _tool_lines(found: CalibratedTool, *, width: int | None) -> Iterator[str]:
    record, calibration = tool_record(found), found.calibration
    yield (
        f"tool centre point: ({_listed(record.tcp_mm, 3)}) mm in the flange frame, from {len(record.touches.points)} "
        f"poses; {np.linalg.norm(calibration.tip - found.before):.3f} mm from where the cell had it"
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
    told = "as given" if touches.noise_given else f"estimated; between {low:.3f} and {high:.3f} in 95 of 100"
    return f"RMS: {touches.rms_mm:.3f} mm; noise of a touch in each direction: {touches.noise_mm:.3f} mm ({told})"


def _touch_lines(touches: TouchesRecord, *, what: str, width: int | None) -> Iterator[str]:
    """Return the table of touches; where it does not fit, without the directions of the residuals."""
    names = max(len(what), *(len(touch.name) for touch in touches.points))
    full = [_touch_line(touch, names=names, directed=True) for touch in touches.points]
    directed = width is None or max(map(len, full)) <= width
    yield "residual of each touch, its length, and how far it lies from where the others put it, mm:"
    axes = "      x       y       z  " if directed else ""
    yield f"  {what:<{names}}  {axes}length  others"
    yield from full if directed else (_touch_line(touch, names=names, directed=False) for touch in touches.points)


def _touch_line(touch: TouchRecord, *, names: int, directed: bool) -> str:
    x, y, z = touch.residual_mm
    direction = f"{x:7.3f} {y:7.3f} {z:7.3f}  " if directed else ""
    length = float(np.linalg.norm(touch.residual_mm))
    return f"  {touch.name:<{names}}  {direction}{length:6.3f}  {touch.miss_mm:6.3f}{'  ODD' if touch.odd else ''}"


def _surface_line(surface: SurfaceUncertaintyRecord) -> str:
    verdict = "a plan will warn" if surface.warned else "good enough"
    if surface.refused:
        verdict = "too much: no plan will be made"
    return (
        f"surface: along its normal within {surface.within_mm:.3f} mm in 95 of 100, at worst at "
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
        "the residuals are larger than the noise given explains (by chance in fewer than 1 of 100 calibrations), so "
        "the noise was estimated from them instead."
    )
    surprising = statistics.excess is not None and not statistics.noise.given
    return marked_lines(warnings=warnings, notes=[estimated] if surprising else [])


def _listed(values: Iterable[float], decimals: int) -> str:
    return ", ".join(f"{round(value, decimals) + 0.0:.{decimals}f}" for value in values)
