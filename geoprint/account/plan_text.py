"""What a person reads of a plan: the few lines when it is done, and the warnings that plan.json carries too."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from geoprint.account.records.plan import DepositionRecord, PatchRecord, PlanRecord
from geoprint.account.records.robot import MotionRecord, RobotRecord
from geoprint.account.robot_summary import LISTED_PLACES
from geoprint.account.verdict import coverage_advice, covers
from geoprint.backends import accuracy, backend, most_accurate_backend
from geoprint.motion.placing import NOTABLE_SHARE
from geoprint.results import Plan, Workpiece
from geoprint.surfaces.files import unit_hint

# A nozzle that leans more than this from the surface normal [degrees] lays a visibly lopsided bead.
NOTABLE_LEAN = 15.0
# Paths whose spacing varies by more than this could be more even with a more accurate backend.
NOTABLE_CV = 0.01


def outcome_text(told: PlanRecord) -> str:
    """Return the lines that a person reads when a plan is done."""
    paths, settings = told.paths, told.settings
    lines = [
        (
            f"{told.input.name}: {paths.runs} runs, {paths.deposit_mm:.0f} mm of path at {settings.spacing_mm:.3g} mm "
            f"spacing ({settings.backend})"
        )
    ]
    if told.uniformity is not None:
        spacing = told.uniformity.spacing
        varies = "one level, no spacing" if spacing is None else f"spacing varies by {spacing.cv:.2%} (CV)"
        lines.append(
            f"evenness: {varies}, uncovered {told.uniformity.gap:.2%}, laid twice {told.uniformity.overlap:.2%}"
        )
    if len(told.patches) > 1:
        lines += [
            f"patch {number}: {patch.area_mm2:.4g} mm2, runs {patch.runs[0] + 1} to {patch.runs[1] + 1}, spacing "
            f"varies by {patch_evenness(patch)} (CV)"
            for number, patch in enumerate(told.patches, start=1)
        ]
    if told.deposition is not None:
        lines.append(_layer_text(told.deposition))
    for robot in told.robot:
        lines += _robot_text(robot)
    return "\n".join([*lines, *(f"note: {warning}" for warning in told.warnings)])


def warnings_of(plan: Plan, told: PlanRecord) -> tuple[str, ...]:
    """Return what a person should know of a plan.

    Args:
        plan: as planned.
        told: its figures.
    """
    workpiece = plan.workpiece
    hint = unit_hint(workpiece.part, unit=workpiece.units[0])
    return (
        *([hint] if hint else []),
        told.surface.side.sentence,
        *_inside(told.patches),
        *_repairs(workpiece),
        *placement_warnings(told.robot),
        *(sentence for robot in told.robot for sentence in _close_targets(robot)),
        *_uncertain(workpiece),
        *([plan.laid.light.lacking] if plan.laid and plan.laid.light and plan.laid.light.lacking else []),
        *_paths(told),
    )


def placement_warnings(robots: Sequence[RobotRecord]) -> list[str]:
    """Return what a person should know of where the part stands, if anything."""
    missing = dict.fromkeys(what for robot in robots for what in robot.motion.placement_missing)
    return [f"PLACEMENT NOT KNOWN: programs run only dry, until somebody states {' and '.join(missing)}."][
        : len(missing)
    ]


def patch_evenness(patch: PatchRecord) -> str:
    """Return how much the spacing of a patch varies, in words."""
    return "- with one level" if patch.spacing.cv is None else f"{patch.spacing.cv:.2%}"


def _layer_text(told: DepositionRecord) -> str:
    away = told.constant_flow.cv is not None
    constant, following = (
        f"{(found.cv if away else found.cv_near_medial_axis) or 0.0:.2%}"
        for found in (told.constant_flow, told.following_flow)
    )
    which = "is constant" if told.flow == "constant" else "follows"
    where = "" if away else "; fronts meet all over this part"
    return (
        f"layer: thickness varies by {constant} with constant flow, {following} with flow that follows the width; here "
        f"it {which}{where}"
    )


def _robot_text(told: RobotRecord) -> list[str]:
    motion, found = told.motion, told.clearance
    return [
        (
            f"motion: {motion.duration_s:.0f} s, smallest wrist angle {motion.smallest_wrist_angle_deg:.1f} degrees, "
            f"{told.program.targets} targets, {motion.targets.shortest_mm:.2g} mm and more apart"
        ),
        _attitude_text(motion),
        _pace_text(motion),
        (
            f"clearance: {found.smallest_mm:.2f} mm at the closest ({found.at}); "
            f"not checked: {', '.join(found.not_checked)}"
        ),
    ]


def _attitude_text(told: MotionRecord) -> str:
    """Return the line on how the nozzle turns about itself, and where it leans."""
    turned = told.rotation.most_deg - told.rotation.least_deg
    if told.rotation.axial_nozzle:
        turn = "on the flange's axis, its turn stays constant because it would move joint 6 only"
    else:
        turn = f"turns about itself over {turned:.0f} degrees along the way"
    places = told.lean.places
    more = " or more" if len(places) == LISTED_PLACES else ""
    lean = (
        f"leans in {len(places)} places{more}, by up to {places[0].lean_deg:.1f} degrees" if places else "leans nowhere"
    )
    return f"nozzle: {turn}; joint 6 makes {told.joint_6_turns:.1f} turns; {lean}"


def _pace_text(told: MotionRecord) -> str:
    """Return one line on the speed of the deposit that names the worst slowdown."""
    line = f"speed: {told.share_at_speed:.1%} of the deposit within 1 % of the set speed"
    if not told.slowdowns:
        return f"{line}; the rest are the ramps at the ends of runs"
    worst = min(told.slowdowns, key=lambda slowdown: slowdown.held_mm_s)
    what = "is lowered" if worst.kind == "lowered" else "dips"
    x, y, z = worst.place_mm
    others = len({slowdown.run for slowdown in told.slowdowns}) - 1
    return (
        f"{line}; run {worst.run + 1} {what} to {worst.held_mm_s:.1f} mm/s by the {worst.limit} of joint "
        f"{worst.joint} at ({x:.1f}, {y:.1f}, {z:.1f})" + (f", {others} more by less" if others else "")
    )


def _inside(patches: Sequence[PatchRecord]) -> list[str]:
    """Return which side of a drawn curve was taken, patch by patch."""
    return [
        f"{f'patch {number}' if len(patches) > 1 else 'the patch'} lies inside {patch.inside}."
        for number, patch in enumerate(patches, start=1)
        if patch.inside is not None
    ]


def _repairs(workpiece: Workpiece) -> Iterator[str]:
    """Say what preparing changed and what it could not check, patch by patch."""
    for number, preparation in enumerate(workpiece.preparations, start=1):
        which = f"patch {number}: " if len(workpiece.preparations) > 1 else ""
        if changes := preparation.repairs.changes():
            yield f"{which}the mesh was repaired: {'; '.join(changes)}."
        if not preparation.crossings_checked:
            yield f"{which}not checked: whether the surface passes through itself, because its triangles are so thin."


def _close_targets(told: RobotRecord) -> Iterator[str]:
    targets = told.motion.targets
    if targets.closer:
        yield (
            f"{targets.closer} targets follow the one before sooner than the controller digests them "
            f"(robot.target_period_ms is {targets.period_ms:g}; the soonest comes after {targets.shortest_ms:.1f} ms): "
            "the arm may slow down there."
        )


def _uncertain(workpiece: Workpiece) -> Iterator[str]:
    uncertainty, standoff = workpiece.uncertainty, workpiece.cell.process.standoff
    if uncertainty is not None and uncertainty.bound > NOTABLE_SHARE * standoff:
        yield (
            f"by the touched points the surface may lie {uncertainty.bound:.2f} mm off along its normal (95 % bound), "
            f"{uncertainty.bound / standoff:.0%} of the stand-off: `geoprint calibrate --part` says which point to "
            "touch next."
        )


def _paths(told: PlanRecord) -> Iterator[str]:
    """Say what was left out, what could be more even, where runs are split, and how far the nozzle leans."""
    paths, measured = told.paths, told.uniformity
    if paths.dropped_runs:
        yield (
            f"closed runs shorter than one spacing were left out: {paths.dropped_runs}, {paths.dropped_mm:.2f} mm long "
            "in all."
        )
    if measured is not None and not covers(measured):
        advice = "".join(coverage_advice(measured, told.settings.spacing_mm))
        yield f"{measured.gap:.1%} of the area is missed and {measured.overlap:.1%} laid twice. {advice}"
    spacing = None if measured is None else measured.spacing
    cv, nearest = 0.0 if spacing is None else spacing.cv, most_accurate_backend()
    if cv > NOTABLE_CV and accuracy(nearest) > accuracy(backend(told.settings.backend or nearest.name)):
        yield f"spacing varies by {cv:.1%}; `--backend {nearest.name}` is nearer to the true distance."
    if paths.corners_split:
        yield (
            f"runs are split at {paths.corners_split} corners that are too sharp to be rounded at speed: the bead ends "
            "and begins there."
        )
    lean = paths.largest_lean_deg
    if lean >= NOTABLE_LEAN:
        yield f"the nozzle leans up to {lean:.0f} degrees from the surface normal where the part bends fast."
