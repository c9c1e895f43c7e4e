"""What a person should know of a plan, as plan.json carries it, by weight.

A warning: the print will be wrong unless somebody acts. A note: what a person wants to know before printing. A detail:
what is as it should be, or acts nowhere yet; it stands in the report and with --verbose.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace

from geoprint.config import common_needles
from geoprint.distance import accuracy, backend, most_accurate_backend
from geoprint.errors import how_many, percent
from geoprint.geometry import face_areas
from geoprint.geometry.files import rebuilt_in_words, unit_hint
from geoprint.model import Cell
from geoprint.reporting.metrics import cover_text
from geoprint.reporting.prints import feedback_notes, made_up_notes
from geoprint.reporting.records.plan import FibresRecord, MotionRecord, PatchRecord, PlanRecord, RobotRecord
from geoprint.reporting.verdict import coverage_advice, covering, medial_axis_sentences
from geoprint.results import Plan, Side, Workpiece
from geoprint.robot.placing import NOTABLE_SHARE
from geoprint.toolpath import creases

# A nozzle that leans more than this from the surface normal [degrees] deposits a visibly lopsided bead.
NOTABLE_LEAN = 15.0
# Paths whose spacing varies by more than this could be more even with a more accurate backend.
NOTABLE_CV = 0.01
# A share of a layer below this may stand out over the one below without a word: its rim, as triangles have it.
LEAST_STANDING_OUT = 0.001
# A tip nearer to the surface than this share of the stand-off deposits a visibly thinner bead.
NOTABLE_HEIGHT = 0.9
# Times that differ by less than this [ms] are one.
ROUNDING_MS = 1e-3
# An arm that keeps the stand-off no better than the first share of it [95 % bound] halves the bead's height somewhere,
# which is worth knowing; from the second on its tip may scratch the part.
NOTABLE_INACCURACY, LARGEST_INACCURACY = 0.5, 1.0


def warnings_of(plan: Plan, record: PlanRecord) -> tuple[str, ...]:
    """Return what a person should act on.

    Args:
        plan: as planned.
        record: its figures.
    """
    workpiece = plan.workpiece
    return (
        *_unit(workpiece),
        *([record.surface.side.sentence] if _is_doubtful(record.surface.side) else []),
        *_unsearched(workpiece),
        *coverage_warnings(record),
        *([] if plan.job.place == "demo" else placement_texts(record.robot)),
        *_pressure(record),
        *_close_targets(record.robot, digested=False),
        *(_wide_needle(plan, record, ploughing=True) if plan.robot else []),
        *_uncertain(workpiece),
        *(_inaccurate(record, least=LARGEST_INACCURACY) if plan.robot else ()),
        *_unheld(workpiece),
        *_unchanging(workpiece),
        *([plan.light.lacking] if plan.light and plan.light.lacking else []),
    )


def _unchanging(workpiece: Workpiece) -> Iterator[str]:
    """Yield that the cell cannot deposit beads of more than one width, where they are wanted."""
    if workpiece.widths is not None and workpiece.cell.signals.mode != "analog":
        yield (
            f"these paths have several widths, and the cell {workpiece.cell.name} can only open and shut its valve: "
            'use a cell with signals.mode "analog".'
        )


def notes_of(plan: Plan, record: PlanRecord) -> tuple[str, ...]:
    """Return what a person wants to know before printing: the printed side, repairs, what was left out.

    Args:
        plan: as planned.
        record: its figures.
    """
    return (
        *(
            []
            if _is_doubtful(record.surface.side) or _is_confirmed(record.surface.side)
            else [record.surface.side.sentence]
        ),
        *(placement_texts(record.robot) if plan.job.place == "demo" else []),
        *(sentence for robot in record.robot for sentence in demonstration_notes(robot.motion)),
        *_inside(record.patches),
        *(f"{file.name} is {said}." for file in plan.workpiece.files if (said := rebuilt_in_words(file))),
        *_repairs(plan.workpiece),
        *feedback_notes(record.feedback),
        *_sources(record),
        *_paths(record),
        *evener_backends(record),
        *_creases(plan),
        *(_wide_needle(plan, record, ploughing=False) if plan.robot else []),
        *made_up_notes(plan, record),
        # A demonstration runs only dry, and not where the part will stand.
        *([] if plan.job.place == "demo" else _near_borders(record.robot)),
        *_close_targets(record.robot, digested=True),
    )


def details_of(plan: Plan, record: PlanRecord) -> tuple[str, ...]:
    """Return what is as it should be, and how it came to be so.

    Args:
        plan: as planned.
        record: its figures.
    """
    return (
        *([record.surface.side.sentence] if _is_confirmed(record.surface.side) else []),
        *medial_axis_sentences(record.middles),
        *(_inaccurate(record, least=NOTABLE_INACCURACY, below=LARGEST_INACCURACY) if plan.robot else ()),
        *(_near_borders(record.robot) if plan.job.place == "demo" else []),
        *_of_each(record.robot, _bends),
    )


def said_once(texts: Mapping[str, Sequence[str]]) -> list[str]:
    """Return what is said of several backends, each sentence once; what does not hold for all names whose it is."""
    every = dict.fromkeys(text for said in texts.values() for text in said)
    whose = {text: [name for name, said in texts.items() if text in said] for text in every}
    return [text if len(whose[text]) == len(texts) else f"{', '.join(whose[text])}: {text}" for text in every]


def placement_texts(robots: Sequence[RobotRecord]) -> list[str]:
    """Return what a person should know of where the part stands, if anything."""
    missing = dict.fromkeys(what for robot in robots for what in robot.motion.placement_missing)
    unknown = "placement" if any(what.startswith("the pose") for what in missing) else "flow"
    return [f"{unknown} unknown: programs only run dry until you state {' and '.join(missing)}."][: len(missing)]


def demonstration_notes(motion: MotionRecord) -> list[str]:
    """Return how a demonstration was turned or moved and why, if it was."""
    notes: list[str] = []
    if (moved := motion.placement_moved) is not None:
        position, rpy = (", ".join(f"{value:g}" for value in each) for each in (moved.position_mm, moved.rpy_deg))
        notes.append(
            f"part moved to demo_position_mm = [{position}], demo_rpy_deg = [{rpy}]. Where the cell puts it, it is "
            f"refused: {moved.start_refused}"
        )
    if (turned := motion.placement_orientation) is not None:
        rpy = ", ".join(f"{angle:g}" for angle in turned.rpy_deg)
        notes.append(
            f"part turned by demo_rpy_deg = [{rpy}], mean normal {turned.tilt_deg:g} degrees from upright: the first "
            f"of {turned.tried} orientations that works. Upright: {turned.start_refused}"
        )
    return notes


def near_borders(motion: MotionRecord) -> list[str]:
    """Return where axes stand near borders of quadrants on deposit, if they do."""
    near = [axis for axis in motion.quadrants if axis.targets_near]
    if not near:
        return []
    least = min(near, key=lambda axis: axis.nearest_deg)
    place = ", ".join(f"{mm:.1f}" for mm in least.place_mm)
    axes = ", ".join(f"axis {axis.axis} at {axis.targets_near} targets" for axis in near)
    record = f"{axes}, the nearest on axis {least.axis} in run {least.run + 1} at ({place}) mm"
    risk = "Another arm may need another configuration there: if its controller stops, move or turn the part"
    return [f"within 1 degree of a quadrant border on deposit: {record}. {risk}."]


def _near_borders(robots: Sequence[RobotRecord]) -> Iterator[str]:
    return _of_each(robots, lambda robot: near_borders(robot.motion))


def _wide_needle(plan: Plan, record: PlanRecord, *, ploughing: bool) -> list[str]:
    """Say that the needle is wider than paths are apart, where it ploughs through the beads beside or passes over."""
    cell, (layer,), widths = plan.workpiece.cell, record.layers, record.paths.widths_mm
    nearest = record.settings.spacing_mm if widths is None else widths[0]
    if ploughing is not (layer.standoff_mm < cell.process.layer_height):
        return []
    return wide_needle_notes(cell, nearest, standoff=layer.standoff_mm)


def wide_needle_notes(cell: Cell, spacing: float, *, standoff: float) -> list[str]:
    """Return that the needle passes over the beads beside its own, how high, and which needle would not, if it does.

    Args:
        cell: its tool and process.
        spacing: of the paths, where they lie closest [mm].
        standoff: of the tip over what the layer lies on [mm].
    """
    width, height = cell.tool.needle_diameter, standoff - cell.process.layer_height
    if width <= spacing:
        return []
    passes = f"{height:.2g} mm above" if height > 0.0 else f"{-height:.2g} mm within" if height else "along the top of"
    narrow = next((needle for needle in common_needles() if needle.outer <= spacing), None)
    other = f"use {narrow.gauge} gauge ({narrow.outer:g} mm)" if narrow else "no common needle is thinner"
    return [
        (
            f"the needle is {width:g} mm wide and the paths are {spacing:g} mm apart: its rim passes {passes} the "
            f"neighbouring beads. {other.capitalize()} (`geoprint guide fine-lines`)."
        )
    ]


def coverage_warnings(record: PlanRecord) -> list[str]:
    """Return that the paths leave holes or cover much twice and what to do, or nothing where they cover the part."""
    measured = record.uniformity
    if measured is None or covering(measured).covers:
        return []
    advice = " ".join(coverage_advice(measured, record.settings.spacing_mm))
    return [f"{cover_text(measured)}. {advice}"]


def fibres_text(record: FibresRecord) -> str:
    """Return what is said of the angles of fibres."""
    off = (
        f"{record.off_mean_deg:.1f} degrees off the field's lines on average, 95 % of their length within "
        f"{record.off_p95_deg:.1f}"
    )
    if record.helix_mean_deg is None or record.helix_deg is None:
        return off
    low, high = record.helix_deg
    return (
        f"{off}; helix angle {record.helix_mean_deg:+.1f} degrees to the direction around the axis, 90 % between "
        f"{low:+.1f} and {high:+.1f}"
    )


def patch_evenness(patch: PatchRecord) -> str:
    """Return how much the spacing of a patch varies, in words."""
    return "- with one level" if patch.spacing.cv is None else percent(patch.spacing.cv, 2)


def _is_doubtful(side: Side) -> bool:
    """Say whether the body below does not confirm the printed side."""
    return side.agreeing is not None and side.source != "body"


def _is_confirmed(side: Side) -> bool:
    """Say whether the body below confirms the printed side as the file has it."""
    return side.source == "body" and not side.turned


def _inside(patches: Sequence[PatchRecord]) -> list[str]:
    """Return which side of a drawn curve was taken, patch by patch."""
    return [
        f"{f'patch {number}' if len(patches) > 1 else 'the patch'} lies inside {patch.inside}."
        for number, patch in enumerate(patches, start=1)
        if patch.inside is not None
    ]


def _repairs(workpiece: Workpiece) -> Iterator[str]:
    """Say what preparing changed, patch by patch."""
    for number, preparation in enumerate(workpiece.preparations, start=1):
        # Every STL has the corners of its faces one by one: to join those that coincide repairs nothing.
        if changes := replace(preparation.repairs, welded_vertices=0).changes():
            yield f"{_which(number, workpiece)}the mesh was repaired: {'; '.join(changes)}."


def _unit(workpiece: Workpiece) -> Iterator[str]:
    """Say where the part is so small or large that its unit may be wrong; of a patch, the body that it was cut from."""
    whole = workpiece.patches[0].body if workpiece.patches else workpiece.base
    hint = unit_hint(whole, unit=workpiece.files[0].unit)
    if hint is not None:
        yield hint


def _unsearched(workpiece: Workpiece) -> Iterator[str]:
    """Say where nobody knows whether the surface passes through itself."""
    for number, preparation in enumerate(workpiece.preparations, start=1):
        if not preparation.crossings_checked:
            yield (f"{_which(number, workpiece)}self-intersection not checked: the triangles are too thin.")


def _which(number: int, workpiece: Workpiece) -> str:
    """Return which of several patches is meant, as a sentence begins."""
    return f"patch {number}: " if len(workpiece.preparations) > 1 else ""


def _of_each(robots: Sequence[RobotRecord], said: Callable[[RobotRecord], Iterable[str]]) -> Iterator[str]:
    """Yield what is said of each part of the robot, and of several in which attitude of a table that is."""
    for number, robot in enumerate(robots, start=1):
        which = f"attitude {number} of {len(robots)}: " if len(robots) > 1 else ""
        yield from (f"{which}{sentence}" for sentence in said(robot))


def _close_targets(robots: Sequence[RobotRecord], *, digested: bool) -> Iterator[str]:
    """Say how many targets follow too soon, in all attitudes of a table together.

    Args:
        robots: its parts.
        digested: whether to say it where all of them come late enough for a controller to take them at all, or where
            not.
    """
    near = {number: one.motion.targets for number, one in enumerate(robots, start=1) if one.motion.targets.closer}
    if not near:
        return
    soonest, count = min(near, key=lambda number: near[number].shortest_ms), sum(one.closer for one in near.values())
    targets = near[soonest]
    if digested != (targets.shortest_ms >= targets.least_ms - ROUNDING_MS):
        return
    whose = f" in attitude {soonest}" if len(robots) > 1 else ""
    yield (
        f"{count} target{'s are' if count > 1 else ' is'} less than {targets.period_ms:g} ms after the previous one "
        f"(robot.target_period_ms), the closest {targets.shortest_ms:.1f} ms{whose}: the arm may slow down there."
    )


def _pressure(record: PlanRecord) -> Iterator[str]:
    """Say that the pressure that the cell names is for another speed than that of the print, where it is."""
    settings, flow = record.settings, record.deposition
    ceiling = max((robot.motion.speed_ceiling_mm_s for robot in record.robot), default=settings.speed_mm_s)
    if settings.pressure_kpa is None or flow is None or settings.speed_mm_s >= ceiling:
        return
    fitted = "" if flow.valve_kpa is None else f", by [material] {flow.valve_kpa:.3g} kPa"
    yield (
        f"the cell's {settings.pressure_kpa:g} kPa suit {ceiling:g} mm/s, and this prints at {settings.speed_mm_s:g} "
        f"mm/s: set the pressure for {flow.valve_mm3_s:.4g} mm3/s{fitted}."
    )


def _bends(record: RobotRecord) -> Iterator[str]:
    """Say in how many bends targets stand beside the path, and where they are closer than a controller takes."""
    bends = record.motion.targets.bends
    rounded = [bend for bend in bends if bend.kind == "rounded"]
    if rounded:
        yield (
            f"in {how_many(len(rounded), 'tight bend')}, targets lie up to "
            f"{max(bend.offset_mm for bend in rounded):.2f} mm outside the path, so that the controller's rounded "
            "corners follow it (listed in plan.json)."
        )
    close = [bend for bend in bends if bend.kind == "close"]
    if close:
        worst = min(close, key=lambda bend: bend.shortest_ms)
        x, y, z = worst.place_mm
        yield (
            f"in {how_many(len(close), 'bend')}, depositing moves are shorter than {record.motion.targets.least_ms:g} "
            f"ms, the shortest {worst.shortest_ms:.1f} ms in run {worst.run + 1} at ({x:z.1f}, {y:z.1f}, {z:z.1f}) mm."
        )


def _uncertain(workpiece: Workpiece) -> Iterator[str]:
    uncertainty, standoff = workpiece.uncertainty, workpiece.cell.process.standoff
    if uncertainty is not None and uncertainty.bound > NOTABLE_SHARE * standoff:
        yield (
            f"the touched points locate the surface within {uncertainty.bound:.2f} mm along its normal (95 % bound), "
            f"{percent(uncertainty.bound / standoff)} of the stand-off. `geoprint calibrate --part` says which point "
            "to touch next."
        )


def _inaccurate(record: PlanRecord, *, least: float, below: float = math.inf) -> Iterator[str]:
    """Say within what the arm keeps the stand-off, where that is from one share of it to another."""
    printed = None if record.uniformity is None else record.uniformity.printed
    found = None if printed is None else printed.standoff
    share = 0.0 if found is None or found.within_mm is None else found.within_mm / found.wanted_mm
    if found is not None and least <= share < below:
        yield (
            f"the arm keeps the stand-off of {found.wanted_mm:g} mm within {found.within_mm:.2f} mm (95 % bound), "
            f"{percent(share)} of it. Raise `standoff_mm`, or measure your arm's path accuracy (`path_accuracy_mm` in "
            "[errors])."
        )


def _unheld(workpiece: Workpiece) -> Iterator[str]:
    """Say of a layer within a target how much of it has nothing below, and how much is too narrow to print."""
    place = workpiece.place
    if place is None:
        return
    if place.standing_out > LEAST_STANDING_OUT * float(face_areas(workpiece.part).sum()):
        yield (
            f"{place.standing_out:.3g} mm2 of the layer overhang the one below by more than its height of "
            f"{place.height:.3g} mm: material may sag there."
        )
    if place.left_out > 0.0:
        yield f"{place.left_out:.3g} mm2 are too narrow for a path and left out: choose a smaller spacing."


def _sources(record: PlanRecord) -> Iterator[str]:
    """Say which source was taken, and how the others would cover, patch by patch."""
    for number in dict.fromkeys(source.patch for source in record.sources):
        tried = [source for source in record.sources if source.patch == number]
        each = (
            f"{source.source} {percent(source.gap, 1)} + {percent(source.overlap, 1)} in {how_many(source.runs, 'run')}"
            for source in sorted(tried, key=lambda source: not source.taken)
        )
        of = f" of patch {number}" if record.sources[-1].patch > 1 else ""
        (taken,) = (source.source for source in tried if source.taken)
        yield (
            f"distance is measured from {taken}, which covers best{of}. Area missed + covered twice: {', '.join(each)}."
        )


def _paths(record: PlanRecord) -> Iterator[str]:
    """Say what was left out, where runs are split, and how far the nozzle leans."""
    paths = record.paths
    if paths.dropped_runs:
        yield (
            f"{how_many(paths.dropped_runs, 'run')} too short to print {'was' if paths.dropped_runs == 1 else 'were'} "
            f"left out: {paths.dropped_mm:.2f} mm, {paths.dropped_mm2:.2g} mm2 in all."
        )
    if paths.corners_split:
        sharp = how_many(paths.corners_split, "corner or edge", "corners or edges")
        yield (f"runs are split at {sharp} too sharp to pass at speed: the bead stops and restarts there.")
    lean = paths.largest_lean_deg
    if lean >= NOTABLE_LEAN:
        yield f"the nozzle leans up to {lean:.0f} degrees from the surface normal where the part curves sharply."


def evener_backends(record: PlanRecord) -> Iterator[str]:
    """Say that another backend would be more even; where several are compared, their figures say so."""
    levels = None if record.uniformity is None else record.uniformity.levels
    # Fitted contours vary on purpose.
    meant = any(each.taken and each.middle != "plain" for each in record.middles)
    spacing, nearest = None if levels is None else levels.spacing, most_accurate_backend()
    cv = 0.0 if spacing is None or meant else spacing.cv
    if cv > NOTABLE_CV and accuracy(nearest) > accuracy(backend(record.settings.backend or nearest.name)):
        yield f"spacing varies by {percent(cv, 1)}: `--backend {nearest.name}` is closer to the true distance."


def _creases(plan: Plan) -> Iterator[str]:
    """Say where the tip cannot follow a crease, and where it comes nearest to the surface."""
    workpiece, standoff = plan.workpiece, plan.poses.standoff
    found = creases(plan.poses, plan.toolpath, workpiece.surface, workpiece.part)
    if not found.count:
        return
    nearest = int(found.distances.argmin())
    row, distance = int(found.poses[nearest]), float(found.distances[nearest])
    place, run = ", ".join(f"{mm:.1f}" for mm in plan.poses.tips[row]), int(plan.poses.runs[row]) + 1
    close = f", at least {distance:.2f} mm above the surface (run {run} at ({place}) mm)"
    yield (
        f"runs cross {how_many(found.count, 'crease')} too narrow for the stand-off of {standoff:g} mm: the tip "
        f"crosses them along smoothed normals{close if distance < NOTABLE_HEIGHT * standoff else ''}."
    )
