"""What is said of a calibration: the lines that a person reads, and the object for programs."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from geoprint.account.rounding import DECIMALS, all_rounded, rounded
from geoprint.export import Json
from geoprint.model import FloatArray
from geoprint.motion.placing import NOTABLE_SHARE, TouchStatistics, Uncertainty
from geoprint.pipeline.calibrating import CalibratedFixture, CalibratedTool


def calibration_text(found: CalibratedFixture | CalibratedTool) -> str:
    """Return the lines that a person reads of a calibration."""
    return "\n".join(_fixture_lines(found) if isinstance(found, CalibratedFixture) else _tool_lines(found))


def calibration_summary(found: CalibratedFixture | CalibratedTool) -> dict[str, Json]:
    """Return a calibration as `--json` prints it: lengths mm, angles degrees, places in the base frame."""
    return _fixture_object(found) if isinstance(found, CalibratedFixture) else _tool_object(found)


def _fixture_lines(found: CalibratedFixture) -> list[str]:
    calibration, next_point = found.calibration, found.suggestion
    statistics = calibration.statistics
    T_base_fixture = calibration.placement.T_base_fixture
    rpy = Rotation.from_matrix(T_base_fixture[:3, :3]).as_euler("xyz", degrees=True)
    where = found.part or "the fixture's points"
    turn = found.turn
    lines = [
        (
            f"fixture: at ({_listed(T_base_fixture[:3, 3], 3)}) mm, roll, pitch, yaw ({_listed(rpy, 3)}) degrees in "
            f"the base frame, from {len(found.names)} touched points"
        ),
        _noise_line(statistics),
        "point: residual x, y, z, its length, and distance from where the others put it, mm",
        *_point_lines(found.names, statistics),
        (
            f"position: at the corners of the box about {where} at worst {found.position.deviation:.3f} mm (standard "
            f"deviation) along ({_listed(found.position.direction, 2)}) at ({_listed(found.position.place, 1)}); "
            f"within {found.position.bound:.3f} mm in 95 of 100 calibrations"
        ),
        (
            f"attitude: at worst {np.degrees(turn.deviation):.3f} degrees about ({_listed(turn.direction, 2)}); within "
            f"{np.degrees(turn.bound):.3f} degrees in 95 of 100"
        ),
    ]
    if found.surface is not None:
        lines.append(_surface_line(found.surface, standoff=found.cell.process.standoff))
    again = f"{next_point.name} again" if next_point.again else next_point.name
    lines.append(
        f"touch next: {again}, at ({_listed(np.array(next_point.model), 1)}) mm in the fixture's frame, "
        f"({_listed(np.array(next_point.base), 1)}) in the base frame; it leaves {next_point.deviation:.3f} mm "
        f"at worst, within {next_point.bound:.3f} mm"
    )
    if not calibration.placement.part_stated:
        lines.append(
            f"note: {found.cell.name} does not state where the part stands on the fixture: write part_mm under [work] "
            "(and part_rpy_deg where the part's axes are turned). Until then programs run only dry, with the part's "
            "origin at the fixture's."
        )
    return lines + _notes(statistics, found.names)


def _tool_lines(found: CalibratedTool) -> list[str]:
    calibration = found.calibration
    statistics = calibration.statistics
    names = _pose_names(statistics)
    lines = [
        (
            f"tool centre point: ({_listed(calibration.tip, 3)}) mm in the flange frame, from {len(names)} poses; "
            f"{np.linalg.norm(calibration.tip - found.before):.3f} mm from where the cell had it"
        ),
        _noise_line(statistics),
        "pose: residual x, y, z, its length, and distance from where the others put it, mm",
        *_point_lines(names, statistics),
        (
            f"uncertainty: at worst {calibration.deviation:.3f} mm (standard deviation) along "
            f"({_listed(calibration.direction, 2)}) of the flange; within {calibration.bound:.3f} mm in 95 of 100 "
            "calibrations"
        ),
    ]
    if found.cell.fixture is not None:
        lines.append("note: the cell's touched points were read with the old tool centre point: touch them again.")
    return lines + _notes(statistics, names)


def _noise_line(statistics: TouchStatistics) -> str:
    noise = statistics.noise
    if noise.given:
        told = "as given"
    else:
        low, high = noise.interval
        told = f"estimated; between {low:.3f} and {high:.3f} in 95 of 100"
    return f"RMS: {statistics.rms:.3f} mm; noise of a touch in each direction: {noise.deviation:.3f} mm ({told})"


def _point_lines(names: tuple[str, ...], statistics: TouchStatistics) -> list[str]:
    width = max(len(name) for name in names)
    return [
        f"  {name:<{width}}  {residual[0]:7.3f} {residual[1]:7.3f} {residual[2]:7.3f}  {np.linalg.norm(residual):6.3f}"
        f"  {miss:6.3f}{'  ODD' if k in statistics.odd else ''}"
        for k, (name, residual, miss) in enumerate(zip(names, statistics.residuals, statistics.misses, strict=True))
    ]


def _surface_line(surface: Uncertainty, *, standoff: float) -> str:
    """Say what the calibration means for printing, by the rule that the plan applies."""
    if surface.bound > standoff:
        verdict = "too much: no plan will be made"
    elif surface.bound > NOTABLE_SHARE * standoff:
        verdict = "a plan will warn"
    else:
        verdict = "good enough"
    return (
        f"surface: along its normal within {surface.bound:.3f} mm in 95 of 100, at worst at "
        f"({_listed(surface.place, 1)}); the stand-off is {standoff:g} mm: {verdict}"
    )


def _notes(statistics: TouchStatistics, names: tuple[str, ...]) -> list[str]:
    notes: list[str] = []
    if statistics.odd:
        odd = ", ".join(names[k] for k in statistics.odd)
        which = "one of these" if len(statistics.odd) > 1 else "this"
        notes.append(
            f"note: {odd}: by chance a good touch looks this odd in fewer than 1 of 100 calibrations; touch {which} "
            "again."
        )
    if statistics.excess is not None and not statistics.noise.given:
        notes.append(
            "note: the residuals are larger than the noise given explains (by chance in fewer than 1 of 100 "
            "calibrations), so the noise was estimated from them instead."
        )
    return notes


def _fixture_object(found: CalibratedFixture) -> dict[str, Json]:
    calibration = found.calibration
    statistics = calibration.statistics
    next_point, standoff = found.suggestion, found.cell.process.standoff
    return {
        "cell": found.cell.name,
        "part": found.part,
        "part_stated": calibration.placement.part_stated,
        "T_base_fixture": _rows(calibration.placement.T_base_fixture),
        "T_base_work": _rows(calibration.placement.T_base_work),
        **_statistics_object(statistics, found.names),
        "centre_mm": all_rounded(calibration.centre),
        # Of the shift [mm] and the turn [rad] about the centre, along and about the base's axes.
        "covariance_mm_rad": calibration.covariance.round(2 * DECIMALS).tolist(),
        "position": _uncertainty_object(found.position),
        "attitude": {
            "deviation_deg": rounded(np.degrees(found.turn.deviation)),
            "within_deg": rounded(np.degrees(found.turn.bound)),
            "about": all_rounded(found.turn.direction),
        },
        "surface": None
        if found.surface is None
        else {
            **_uncertainty_object(found.surface),
            "standoff_mm": standoff,
            "refused": found.surface.bound > standoff,
            "warned": found.surface.bound > NOTABLE_SHARE * standoff,
        },
        "touch_next": {
            "name": next_point.name,
            "again": next_point.again,
            "fixture_mm": all_rounded(np.array(next_point.model)),
            "base_mm": all_rounded(np.array(next_point.base)),
            "deviation_mm": rounded(next_point.deviation),
            "within_mm": rounded(next_point.bound),
        },
    }


def _tool_object(found: CalibratedTool) -> dict[str, Json]:
    calibration = found.calibration
    return {
        "cell": found.cell.name,
        "tcp_mm": all_rounded(calibration.tip),
        "before_mm": all_rounded(found.before),
        "touched_mm": all_rounded(calibration.touched),
        **_statistics_object(calibration.statistics, _pose_names(calibration.statistics)),
        "deviation_mm": rounded(calibration.deviation),
        "along": all_rounded(calibration.direction),
        "within_mm": rounded(calibration.bound),
        "fixture_outdated": found.cell.fixture is not None,
    }


def _statistics_object(statistics: TouchStatistics, names: tuple[str, ...]) -> dict[str, Json]:
    noise = statistics.noise
    return {
        "rms_mm": rounded(statistics.rms),
        "noise_mm": rounded(noise.deviation),
        "noise_given": noise.given,
        "noise_between_mm": all_rounded(noise.interval),
        "chance_of_residuals": None if statistics.excess is None else rounded(statistics.excess),
        "points": [
            {
                "name": name,
                "residual_mm": all_rounded(statistics.residuals[k]),
                "miss_mm": rounded(statistics.misses[k]),
                "chance": rounded(statistics.chances[k]),
                "odd": k in statistics.odd,
            }
            for k, name in enumerate(names)
        ],
    }


def _pose_names(statistics: TouchStatistics) -> tuple[str, ...]:
    return tuple(str(number) for number in range(1, len(statistics.residuals) + 1))


def _uncertainty_object(uncertainty: Uncertainty) -> dict[str, Json]:
    return {
        "deviation_mm": rounded(uncertainty.deviation),
        "within_mm": rounded(uncertainty.bound),
        "at_mm": all_rounded(uncertainty.place),
        "along": all_rounded(uncertainty.direction),
    }


def _rows(matrix: FloatArray) -> list[Json]:
    return [all_rounded(row) for row in matrix]


def _listed(values: FloatArray, decimals: int) -> str:
    return ", ".join(f"{round(value, decimals) + 0.0:.{decimals}f}" for value in values.tolist())
