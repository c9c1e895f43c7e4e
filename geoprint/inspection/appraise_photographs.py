"""Photographs of prints, appraised side by side and against the plan of them, and how the result lands on disk."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from pathlib import Path
from typing import final

import numpy as np

from geoprint.errors import InputError, UsageError, naming
from geoprint.inspection.against_plan import planned_runs
from geoprint.inspection.beads import BeadLine, Shade, bead_width, beads_of, middles_of, paired_edges
from geoprint.inspection.calibrating import Fiducials, camera_by
from geoprint.inspection.camera import Camera, Lens
from geoprint.inspection.executing import printed_program
from geoprint.inspection.held import bead_lines, held_against, photographed_parts
from geoprint.inspection.inputs import PlannedPrint, lens_text, read_beside, read_fiducials, read_lens, read_plan
from geoprint.inspection.measured import PRESENT, measured_stretches
from geoprint.inspection.on_part import apart, in_sight
from geoprint.inspection.outline import picture_outline
from geoprint.inspection.outline_pose import PrintedLines, camera_by_outline
from geoprint.inspection.pages import photographs_page
from geoprint.inspection.photograph import Photograph, read_photograph
from geoprint.inspection.print import Appraisal, AppraisedPhotograph, OnPlan
from geoprint.inspection.records import appraisal_pictures, appraisal_tables, record_appraisal
from geoprint.inspection.text import appraisal_text
from geoprint.model import Surface
from geoprint.process.feedback import PrintedProgram
from geoprint.reporting.prints import RECORD, next_print
from geoprint.reporting.records.inspection import AppraisalRecord
from geoprint.reporting.records.rounding import save_record
from geoprint.workflow.saving import written

# More are no comparison any more.
MOST_PHOTOGRAPHS = 20
# What of a plan is seen lies so far within the picture [pixels].
MARGIN = 10.0


@final
@dataclass(frozen=True, slots=True)
class PlanAsked:
    """What prints are held against, and what the camera is placed by.

    Attributes:
        bundle: folder of the plan.
        fiducials: a table for all photographs, or one for each; where none is given the part's outline places the
            camera.
        lens: a file that states it, or photographs of a checkerboard.
        corners: inner corners of the board, as 9x6.
        reach: how far from a run its material may lie [mm]; half the spacing of the plan if not given.
    """

    bundle: Path
    fiducials: tuple[Path, ...]
    lens: tuple[Path, ...]
    corners: str | None = None
    reach: float | None = None


@final
@dataclass(frozen=True, slots=True)
class _Against:
    """A plan as read, a lens, and where each photograph shows fiducials, or else what stands beside the part."""

    plan: PlannedPrint
    lens: Lens
    fiducials: tuple[Fiducials, ...]
    beside: tuple[Surface, ...]
    reach: float | None


def appraise_photographs(
    paths: Sequence[Path | str],
    *,
    against: PlanAsked | None = None,
    shade: Shade = "lighter",
    width: float | None = None,
    threshold: float | None = None,
    observe: Callable[[str], None] = lambda _: None,
) -> Appraisal:
    """Appraise photographs of prints.

    Args:
        paths: of the photographs; several are of one size, by a camera that stood still.
        against: the plan that they are held against; None where there is none.
        shade: what beads are, beside what they lie on.
        width: of beads [pixels]; that of the highest contrast, in each photograph, if not given.
        threshold: of their contrast, over the spread of the grey values around them; [Otsu1979] if not given.
        observe: told the name of each stage as it starts.

    Raises:
        UsageError: an option has no meaning, or a package is missing.
        InputError: a file cannot be read, shows no bead, or does not fit the others.
        VerificationError: the bundle was changed.
    """
    _check(paths, against, width=width, threshold=threshold)
    observe("photographs")
    photographs = _photographs(paths)
    held = None if against is None else _read(against, photographs)
    found: list[AppraisedPhotograph] = []
    for number, photograph in enumerate(photographs):
        observe(photograph.name)
        with naming(photograph.name):
            if held is not None and held.fiducials:
                camera = camera_by(held.fiducials[number % len(held.fiducials)], held.lens)
                found.append(_on_plan(photograph, camera, held, shade=shade))
                continue
            lines = _lines(photograph, shade=shade, width=width, threshold=threshold)
            if held is not None:
                lines = _on_plan(photograph, _by_outline(photograph, lines.beads, held), held, shade=shade)
            found.append(lines)
    pairs = tuple(
        (one, other, apart(middles_of(found[one].beads), middles_of(found[other].beads)))
        for one, other in combinations(range(len(found)), 2)
    )
    appraisal = Appraisal(shade, width is None, threshold is None, tuple(found), pairs)
    if against is None or held is None:
        return appraisal
    observe("program")
    plan, printed = held.plan, _printed(against.bundle, held.plan, found)
    return replace(appraisal, plan=plan.name, printed_with=plan.printed_with, part=plan.part, printed=printed)


@written.register
def _save(found: Appraisal, directory: Path | str, *, overwrite: bool) -> AppraisalRecord:
    """Write appraisal.json, text, tables, pictures, report.html, and the lens if it was calibrated."""
    record = record_appraisal(found)
    on_plan = found.photographs[0].on_plan
    # A lens that was given needs no second file.
    calibrated = None if on_plan is None or on_plan.camera.lens.residual == 0.0 else on_plan.camera.lens
    lens = {} if calibrated is None else {"lens.toml": lens_text(calibrated).encode("utf-8")}
    pictures = appraisal_pictures(found)
    following = "" if record.printed is None else f"\n{next_print(record, plan=record.printed.plan, folder='.')}\n"
    files = {
        "appraisal.txt": f"{appraisal_text(record)}\n{following}".encode(),
        **appraisal_tables(found),
        **pictures,
        "report.html": photographs_page(found, record, pictures),
        **lens,
    }
    return save_record(record, RECORD, files, directory, overwrite=overwrite)


def _printed(bundle: Path, plan: PlannedPrint, found: Sequence[AppraisedPhotograph]) -> PrintedProgram | None:
    """Return the program of the print that one photograph shows; of several no one is the print."""
    on_plan = found[0].on_plan if len(found) == 1 else None
    if on_plan is None:
        return None
    parts = photographed_parts(on_plan.held)
    return printed_program(bundle, plan, runs=parts.runs, starts=parts.starts, ends=parts.ends)


def _lines(
    photograph: Photograph, *, shade: Shade, width: float | None, threshold: float | None
) -> AppraisedPhotograph:
    """Look for beads in a photograph where no plan says where they are."""
    width = bead_width(photograph.grey, shade=shade) if width is None else width
    paired = paired_edges(photograph.grey, width=width, shade=shade, threshold=threshold)
    beads = beads_of(photograph.grey, paired, shade=shade)
    return AppraisedPhotograph(photograph, width, paired.threshold, beads, None)


def _by_outline(photograph: Photograph, beads: tuple[BeadLine, ...], against: _Against) -> Camera:
    """Return the camera that the outline of the part places."""
    plan = against.plan
    return camera_by_outline(
        picture_outline(photograph.grey),
        replace(plan.surface, name=plan.part),
        against.lens,
        lines=PrintedLines(beads, plan.surface, planned_runs(plan.poses, spacing=plan.spacing)),
        beside=against.beside,
    )


def _on_plan(photograph: Photograph, camera: Camera, against: _Against, *, shade: Shade) -> AppraisedPhotograph:
    """Hold a photograph against the plan."""
    plan = against.plan
    runs = planned_runs(plan.poses, spacing=plan.spacing)
    visible = in_sight(camera, plan.surface, runs.places, size=photograph.size, margin=MARGIN)
    measured = measured_stretches(photograph.grey, runs, camera, plan.surface, visible=visible)
    if measured.darker != (shade == "darker"):
        found, other = ("darker", "lighter") if measured.darker else ("lighter", "darker")
        raise InputError(
            f"along the runs the picture is {found} than beside them, not {other}: give `--shade {found}` if beads "
            "are, as in a negative. Otherwise the print lies between its runs, or the fiducials are wrong."
        )
    held = held_against(
        runs, measured, visible=visible, height=plan.height, pose_deviation=camera.deviation * measured.scale,
        reach=against.reach,
    )  # fmt: skip
    beads = bead_lines(held, camera)
    width = float(np.median((measured.lefts - measured.rights)[measured.edged])) / measured.scale
    return AppraisedPhotograph(photograph, width, PRESENT, beads, OnPlan(camera, held))


def _read(asked: PlanAsked, photographs: Sequence[Photograph]) -> _Against:
    """Read what photographs are held against.

    Raises:
        UsageError: something is missing, or there are too many tables of fiducials.
        InputError: the lens is of photographs of another size.
    """
    if not asked.lens:
        raise UsageError(
            "a plan needs the camera: give `--lens`, a file or photographs of a checkerboard. Also show the whole "
            "outline of the part, or give `--fiducials`, a table of at least four points."
        )
    if len(asked.fiducials) not in {0, 1, len(photographs)}:
        raise UsageError(
            f"give `--fiducials` once for all photographs, or once for each of the {len(photographs)}; found "
            f"{len(asked.fiducials)}."
        )
    if asked.reach is not None and not 0.0 < asked.reach < float("inf"):
        raise UsageError(f"`--reach {asked.reach:g}`: it must be a positive number of mm.")
    lens = read_lens(asked.lens, corners=asked.corners)
    for each in photographs:
        if each.size != lens.size:
            raise InputError(
                f"`{each.name}` has {each.size[0]} x {each.size[1]} pixels, the lens is of photographs of "
                f"{lens.size[0]} x {lens.size[1]}; give photographs as the camera wrote them, and their lens."
            )
    plan, fiducials = read_plan(asked.bundle), tuple(read_fiducials(path) for path in asked.fiducials)
    return _Against(plan, lens, fiducials, () if fiducials else read_beside(asked.bundle), asked.reach)


def _check(
    paths: Sequence[Path | str], against: PlanAsked | None, *, width: float | None, threshold: float | None
) -> None:
    if not 1 <= len(paths) <= MOST_PHOTOGRAPHS:
        raise UsageError(f"give 1 to {MOST_PHOTOGRAPHS} photographs, found {len(paths)}.")
    for flag, value in (("--width", width), ("--threshold", threshold)):
        if value is not None and not 0.0 < value < float("inf"):
            raise UsageError(f"`{flag} {value:g}`: it must be a positive number.")
    if against is not None and against.fiducials and (width, threshold) != (None, None):
        raise UsageError(
            "`--width` and `--threshold` look for lines where no plan says where they are; leave them out where "
            "`--fiducials` and `--plan` do."
        )


def _photographs(paths: Sequence[Path | str]) -> list[Photograph]:
    """Read photographs of one size."""
    photographs = [read_photograph(path) for path in paths]
    first = photographs[0]
    for other in photographs[1:]:
        if other.size != first.size:
            raise InputError(
                f"`{first.name}` has {first.size[0]} x {first.size[1]} pixels and `{other.name}` {other.size[0]} x "
                f"{other.size[1]}, so distances between them are meaningless. Keep the camera fixed, or appraise them "
                "one by one."
            )
    return photographs
