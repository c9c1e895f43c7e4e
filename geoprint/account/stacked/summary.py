"""What stack.json says of the layers of a stack and of all of them together."""

from __future__ import annotations

from geoprint.account.records.plan import PlanRecord
from geoprint.account.records.stack import FinishedFlowsRecord, FinishedRecord, StackedLayerRecord
from geoprint.results import FinishedStack, StackedLayer


def layer_record(
    told: PlanRecord,
    kept: StackedLayer,
    *,
    folder: str,
    area: float,
    pattern: str,
    speed: float,
    not_printable: str | None,
) -> StackedLayerRecord:
    """Return what is said of a planned layer.

    Args:
        told: what its plan.json says.
        kept: what is kept of it.
        folder: of its bundle.
        area: of the surface in its middle [mm2].
        pattern: that its paths have.
        speed: at which it prints, before its missing volume is made up [mm/s].
        not_printable: why the robot cannot print it, or None.
    """
    even, robots, laid = told.uniformity, told.robot, told.deposition
    layer = None if even is None or laid is None else even.thickness if laid.flow == "constant" else even.following
    return StackedLayerRecord(
        folder=folder,
        bottom_mm=kept.bottom,
        height_mm=kept.height,
        area_mm2=area,
        pattern=pattern,
        runs=told.paths.runs,
        deposit_mm=told.paths.deposit_mm,
        gap=None if even is None else even.gap,
        overlap=None if even is None else even.overlap,
        thickness_cv=None if layer is None else layer.cv,
        helix_deg=None if told.paths.fibres is None else told.paths.fibres.helix_mean_deg,
        speed_mm_s=speed,
        laid_mm3=float(kept.volumes[kept.printed]),
        wanted_mm3=area * kept.height,
        print_s=_seconds(told),
        attitudes=len(robots) if any(robot.table is not None for robot in robots) else None,
        clearance_mm=min((robot.clearance.smallest_mm for robot in robots), default=None),
        not_printable=not_printable,
        dose_mj_cm2=None if laid is None or laid.light is None else laid.light.all_passes,
        warnings=told.warnings,
        not_checked=tuple(dict.fromkeys(text for robot in robots for text in robot.clearance.not_checked)),
    )


def _seconds(told: PlanRecord) -> float | None:
    """Return how long a layer prints, with the motions of a table; None without a robot [s]."""
    if told.joined is not None:
        return told.joined.print_s
    return sum(robot.motion.duration_s for robot in told.robot) if told.robot else None


def finished_record(stack: FinishedStack, *, wanted: float) -> FinishedFlowsRecord:
    """Return how a stack comes out.

    Args:
        stack: all of its layers.
        wanted: the volume that it shall have [mm3].
    """
    told = [
        None
        if found is None
        else FinishedRecord(
            mean=found.mean,
            cv=found.cv,
            p1=found.p1,
            p99=found.p99,
            within_5_percent=found.within_5_percent,
            judged=found.judged,
            creased=found.creased,
            under_sides=found.under_sides,
            volume=sum(float(layer.volumes[flow]) for layer in stack.layers) / wanted,
        )
        for flow, found in enumerate(stack.flows)
    ]
    return FinishedFlowsRecord(constant_flow=told[0], following_flow=told[1], printed=told[stack.printed])
