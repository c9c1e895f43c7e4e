"""What a person reads of a plan: the few lines when it is done."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.metadata import version

from geoprint.account.cautions import fibres_text, patch_evenness
from geoprint.account.metrics import COVERED_ONCE, FOLLOWING, GAP, OFF, OFF_MOST, OVERLAP, THICKNESS
from geoprint.account.prints.expected import WORDS, expected_text
from geoprint.account.prints.overhang import overhang_lines
from geoprint.account.records.evenness import EvennessRecord
from geoprint.account.records.plan import DepositionRecord, PlanRecord
from geoprint.account.records.printed import PrintedRecord
from geoprint.account.records.robot import JoinedRecord, MotionRecord, RobotRecord
from geoprint.account.records.rounding import how_many
from geoprint.account.robot_summary import LISTED_PLACES
from geoprint.account.texts.marks import marked_lines


def outcome_text(told: PlanRecord, *, verbose: bool = False) -> str:
    """Return the lines that a person reads when a plan is done.

    Args:
        told: what plan.json says.
        verbose: whether to list details, and all that was not checked.
    """
    lines = _path_lines(told)
    lines += [
        f"layer {layer.number + 1} of {layer.count}: from {layer.bottom_mm:.3g} to "
        f"{layer.bottom_mm + layer.height_mm:.3g} mm over the part, paths in its middle"
        + (f", {layer.pattern}" if layer.pattern else "")
        for layer in told.layers
        if layer.count > 1
    ]
    if told.uniformity is not None:
        lines.append(_evenness_text(told.uniformity, told.deposition))
        if told.uniformity.distance is not None:
            off, most = OFF.text(told.uniformity), OFF_MOST.text(told.uniformity)
            lines.append(f"distance: level curves are off by {off} of a spacing (standard deviation), {most} at most")
        lines += [] if told.uniformity.printed is None else [_printed_text(told.uniformity.printed)]
    if len(told.patches) > 1:
        lines += [
            f"patch {number}: {patch.area_mm2:.4g} mm2, runs {patch.runs[0] + 1} to {patch.runs[1] + 1}, spacing "
            f"varies by {patch_evenness(patch)} (CV)"
            for number, patch in enumerate(told.patches, start=1)
        ]
    if told.overhang is not None:
        lines += overhang_lines(told.overhang, verbose=verbose)
    for robot in told.robot:
        lines += _robot_text(robot, speed=told.settings.speed_mm_s)
    if told.joined is not None:
        lines.append(_joined_text(told.joined, count=len(told.robot)))
    if told.not_printable is not None:
        lines.append(f"no program: the robot cannot print this: {told.not_printable}")
    unchecked = list(dict.fromkeys(text for robot in told.robot for text in robot.clearance.not_checked))
    lines += marked_lines(
        warnings=told.warnings, notes=told.notes, details=told.details, not_checked=unchecked, verbose=verbose
    )
    return "\n".join(lines)


def _path_lines(told: PlanRecord) -> list[str]:
    paths, settings = told.paths, told.settings
    lines = [
        (
            f"{told.input.name}: {how_many(paths.runs, 'run')}, {paths.deposit_mm:.0f} mm of path at "
            f"{settings.spacing_mm:.3g} mm "
            f"spacing ({settings.backend})"
        )
    ]
    if paths.widths_mm is not None:
        least, most = paths.widths_mm
        lines.append(f"width: {least:.3g} to {most:.3g} mm wanted; evenness, gaps and flow are over that")
    if paths.fibres is not None:
        lines.append(f"fibres: {fibres_text(paths.fibres)}")
    return lines


def again_text(folder: str, *, written_by: str, differing: Sequence[str], changed: Sequence[str]) -> str:
    """Return the line on a bundle that was planned again.

    Args:
        folder: the bundle that it was made from.
        written_by: the version of geoprint that wrote that one.
        differing: files that have other bytes than there.
        changed: keys of the job that were given another value.
    """
    again = f"planned again from {folder}"
    if changed:
        keys = ", ".join(name.replace("_", " ") for name in changed)
        return f"{again}, with another {keys}: {len(differing)} files differ"
    if not differing:
        return f"{again}: all files have the same bytes"
    now = version("geoprint")
    why = "last digits of numbers may turn with the machine and its libraries"
    other = why if written_by == now else f"geoprint {written_by} wrote that one, this is {now}"
    return f"warning: {again}, but {len(differing)} files differ ({', '.join(differing[:3])} ...): {other}"


def _printed_text(told: PrintedRecord) -> str:
    """Return the line on the thickness in print."""
    mend = "the plan itself makes most of it" if told.mend_first is None else f"mend first {WORDS[told.mend_first]}"
    whose = "" if told.errors == "cell" else "; errors of the packaged cell"
    return f"in print: thickness expected to vary by {expected_text(told)}, 95 of 100 prints in brackets; {mend}{whose}"


def _evenness_text(told: EvennessRecord, flow: DepositionRecord | None) -> str:
    """Return the line on how evenly the paths cover the part."""
    covered = f"area covered once {COVERED_ONCE.text(told)}, missed {GAP.text(told)}, twice {OVERLAP.text(told)}"
    here = "" if flow is None else f"; here the flow {'is constant' if flow.flow == 'constant' else 'follows'}"
    return (
        f"evenness: layer thickness varies by {THICKNESS.text(told)} with constant flow, {FOLLOWING.text(told)} with "
        f"flow that follows the width (CV){here}; {covered}"
    )


def _robot_text(told: RobotRecord, *, speed: float) -> list[str]:
    motion, found = told.motion, told.clearance
    named = "" if told.table is None else f"attitude {told.table.attitude}, "
    return [
        (
            f"{named}motion: {motion.duration_s:.0f} s, smallest wrist angle {motion.smallest_wrist_angle_deg:.1f} "
            f"degrees, {told.program.targets} targets, {motion.targets.shortest_mm:.2g} mm and more apart"
        ),
        _attitude_text(motion),
        _speed_text(motion, speed=speed),
        f"clearance: {found.smallest_mm:.2f} mm at the closest ({found.at})",
    ]


def _joined_text(told: JoinedRecord, *, count: int) -> str:
    """Return the line on the program of all attitudes."""
    return (
        f"program: {count} attitudes of the table one after another, {told.print_s:.0f} s with its own motions; it "
        f"asks for each while the arm waits at home; executed in {len(told.scenarios)} scenarios: {told.file}"
    )


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
        f"leans in {how_many(len(places), 'place')}{more}, by up to {places[0].lean_deg:.1f} degrees"
        if places
        else "leans nowhere"
    )
    return f"nozzle: {turn}; joint 6 makes {told.joint_6_turns:.1f} turns; {lean}"


def _speed_text(told: MotionRecord, *, speed: float) -> str:
    """Return one line on the speed of the print, where it dips and why, and what is deposited."""
    ceiling = f" (ceiling {told.speed_ceiling_mm_s:g})" if speed < told.speed_ceiling_mm_s else ""
    line = f"speed: prints at {speed:g} mm/s{ceiling}, {told.share_at_speed:.1%} of the deposit within 1 % of it"
    if told.slowdowns:
        worst = min(told.slowdowns, key=lambda dip: dip.held_mm_s)
        length = sum(dip.length_mm for dip in told.slowdowns)
        why = f"the {worst.limit} of joint {worst.joint}" if worst.joint else "the spacing of its targets in a bend"
        x, y, z = worst.place_mm
        where = f"in run {worst.run + 1} by {why} at ({x:.1f}, {y:.1f}, {z:.1f})"
        line += f"; down to {worst.held_mm_s:.3g} mm/s over {length:.3g} mm, {where}"
    found = told.deposited
    if found is None:
        return line
    return f"{line}; deposits {found.share:.1%}, runs {found.least_run:.1%} to {found.most_run:.1%}"
