"""What is planned on: cell, part and body as read, its printed side, where it stands, and the part refined.

The printed side is that of the file's winding, unless the body that the part lies on tells another.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import final

import numpy as np

from geoprint.backends import Piecewise, backend
from geoprint.config import Job, cell_text, job_cell, stored_field
from geoprint.deposition import WidthsOver
from geoprint.errors import FieldError, InputError, UsageError
from geoprint.export.rapid import check_cell
from geoprint.model import Cell, Placement, Surface, TouchedPoints, frozen
from geoprint.motion.arm import Arm, check_load, require_abb_conventions
from geoprint.motion.placing import (
    LEAST_MEAN_NORMAL,
    SHORTEST_MEAN_NORMAL,
    FixtureCalibration,
    Uncertainty,
    calibrate_fixture,
    demo_placement,
    normal_uncertainty,
    refuse_uncertain,
)
from geoprint.pipeline.choice import backend_of
from geoprint.pipeline.feeding import feedback_text
from geoprint.pipeline.stages import Stages
from geoprint.pipeline.workpiece.best_source import with_best_sources
from geoprint.pipeline.workpiece.layering import Stack, even_stack, layer_of, stack_cell, stack_of
from geoprint.pipeline.workpiece.several_patches import PreparedPart, prepared_part
from geoprint.pipeline.workpiece.siding import printed_side
from geoprint.pipeline.workpiece.sources import seed_of
from geoprint.pipeline.workpiece.targets import read_target
from geoprint.pipeline.workpiece.widths import check_widths, least_spacing, widths_of
from geoprint.results import Side, StackPlace, TargetFile, Workpiece
from geoprint.surfaces import (
    closest,
    pieces,
    turned_over,
    united,
    vertex_normals,
)
from geoprint.surfaces.files import MeshFile, load_file
from geoprint.surfaces.remesh import refine
from geoprint.transforms import apply

# Resolution at which the largest distance is estimated before the spacing is known, in triangles across the part.
TRIANGLES_ACROSS = 60
# A mirrored part lies on the body but for this share of its size.
MIRRORED_SHARE = 0.05


def prepare_workpiece(job: Job, stage: Stages, *, backends: Sequence[str]) -> Workpiece:
    """Read cell, part and body, decide where the part stands, and refine it for whichever backend needs it finest.

    Args:
        job: what to plan.
        stage: names and times the work.
        backends: that shall plan on it.

    Raises:
        UsageError: the job or its cell is unclear or contradicts itself.
        InputError: a file cannot be planned on.
        ReachError: the part has no demonstration placement.
        ClearanceError: the touched points determine the part's surface worse than the stand-off.
    """
    with stage("reading"):
        # In the order in which a person thinks: cell, unit, spacing, placement; and all of it before the long work. A
        # large file is parsed only for a job that says what can be said without it.
        cell = job_cell(job)
        job = with_rounds(job, cell)
        if job.unit is not None and (job.spacing is not None or job.rounds is not None):
            _require_placement(job, cell)
        loaded = load_file(job.surface, unit=job.unit, label=job.label, threshold=job.threshold)
        if job.rounds is None:
            _wanted_spacing(job, loaded.surface if job.spacing is not None else prepared_part(job, loaded).surface)
        _require_placement(job, cell)
        sided = sided_part(job, loaded, cell)
        turnable = _turnable(job, cell, sided)
        cell = replace(cell, demo_rotation=cell.demo_turn)
        placement, uncertainty = _placement(job, cell, sided.base, turnable=turnable)
    with stage("refining"):
        surface, edge_length = _refined(sided, backends, spacing=_wanted_spacing(job, sided.part))
        workpiece = Workpiece(
            cell=stack_cell(cell, sided.place),
            part=sided.part,
            side=sided.side,
            body=sided.body,
            files=sided.files,
            target=sided.target,
            cell_text=None if job.cell is None else cell_text(job.cell),
            patches=sided.prepared.patches,
            preparations=sided.prepared.preparations,
            edge_length=edge_length,
            surface=surface,
            seed=seed_of(job, surface, base=None if sided.place is None else sided.place.base),
            placement=placement,
            uncertainty=uncertainty,
            turnable=turnable,
            place=sided.place,
            field=None if job.field is None else stored_field(job.field),
            widths=sided.widths,
            feedback_text=None if job.feedback is None else feedback_text(job.feedback),
        )
    with stage("source"):
        return with_best_sources(job, workpiece, backends=backends)


def _turnable(job: Job, cell: Cell, sided: SidedPart) -> bool:
    """Say whether a demonstration may turn the part; layers stand where that on the part does, a table turns it."""
    free = cell.demo_rotation is None and cell.table is None
    return job.robot and job.place == "demo" and free and sided.place is None


@final
@frozen
class SidedPart:
    """The part of a job on the side that is printed.

    Attributes:
        files: as `Workpiece.files`.
        prepared: as the file is wound.
        part: on the printed side; of a layer its middle.
        side: how that was found.
        body: what the part lies on, or None.
        place: of the layer in its stack, or None.
        target: what layers fill, as it was read, or None.
        widths: how wide fibres are, which the cell can lay; None where they are one spacing wide.
    """

    files: tuple[MeshFile, ...]
    prepared: PreparedPart
    part: Surface
    side: Side
    body: Surface | None
    place: StackPlace | None = None
    target: TargetFile | None = None
    widths: WidthsOver | None = None

    @property
    def base(self) -> Surface:
        """The part itself, whatever layers lie on it."""
        return self.part if self.place is None else self.place.base


def read_part(job: Job) -> SidedPart:
    """Read the part of a job and its body, and decide which side is printed.

    Raises:
        UsageError: a unit or a label is unclear.
        InputError: a file cannot be planned on.
    """
    cell = job_cell(job)
    return sided_part(job, load_file(job.surface, unit=job.unit, label=job.label, threshold=job.threshold), cell)


def sided_part(job: Job, loaded: MeshFile, cell: Cell) -> SidedPart:
    """Return what `read_part` does of a part that was read."""
    skin = _skin(job, loaded)
    place = layer_of(job, cell, skin.part, skin.target)
    # What the layers below are made of lies between the part and the middle of this one.
    sided = skin if place is None else replace(skin, part=place[1], body=skin.body or skin.part, place=place[0])
    widths = widths_of(job, sided.part, sided.place)
    if widths is not None:
        check_widths(widths, job, cell, sided.place)
    return replace(sided, widths=widths)


def read_stack(job: Job) -> Stack:
    """Return in which layers a job falls; the part is read only where that depends on it.

    Raises:
        UsageError: the job has no layers.
        GeoprintError: as `read_part`, and as `stack_of`.
    """
    cell = job_cell(job)
    if job.thickness is not None and job.feather is None:
        return even_stack(job.thickness, cell)
    skin = _skin(job, load_file(job.surface, unit=job.unit, label=job.label, threshold=job.threshold))
    stack = stack_of(job, cell, skin.part, skin.target)
    if stack is None:
        raise UsageError("this job is of a single skin: give `--thickness` in mm, or a `--target`.")
    return stack


def _skin(job: Job, loaded: MeshFile) -> SidedPart:
    """Return the part itself, whatever layers lie on it."""
    prepared = prepared_part(job, loaded)
    named = None if job.body is None else load_file(job.body, unit=job.unit)
    body = prepared.body if named is None else _body(prepared.surface, named.surface)
    asked = turned_over(prepared.surface) if job.flip else prepared.surface
    filed, cut = (named or loaded).surface, named is None and body is not None
    part, side = printed_side(asked, body, flip=job.flip, filed=filed, cut=cut)
    files = (loaded,) if named is None else (loaded, named)
    return SidedPart(files, prepared, part, side, body, target=read_target(job))


def _require_placement(job: Job, cell: Cell) -> None:
    """Refuse, before the long work, a cell from which no program can come."""
    if not job.robot:
        return
    if job.place == "best":
        raise UsageError("the place 'best' is looked for before planning: `best_placed(job)` returns the job there.")
    if job.place is None:
        _fixture(cell)
    check_cell(cell)
    arm = Arm(cell.robot, T_flange_tool=cell.tool.T_flange_tool)
    require_abb_conventions(arm)
    check_load(cell.tool, arm)


def _fixture(cell: Cell) -> TouchedPoints:
    """Return the touched points of a calibrated cell."""
    if cell.fixture is None:
        raise UsageError(
            f"the cell {cell.name} is not calibrated, so nobody knows where the part stands: touch four or more points "
            "of its fixture with the tool (`geoprint calibrate` fits them), or add `--place demo` for a program that "
            "only runs dry, or `--no-robot` for the path alone."
        )
    return cell.fixture


def _body(part: Surface, body: Surface) -> Surface:
    """Return the body; one that lies farther from the part than the part is large is another's, or in another unit."""
    _, distances = closest(body, part.vertices)
    size = _size(part)
    if distances.min() > size:
        mirrors = zip("xyz", part.vertices * (1.0 - 2.0 * np.eye(3))[:, None], strict=True)
        on = [axis for axis, mirrored in mirrors if closest(body, mirrored)[1].max() < MIRRORED_SHARE * size]
        seen = f" Mirrored in {on[0]} it lies on it: one of the files is left-handed, so export it again." if on else ""
        raise InputError(
            f"{body.name} is {distances.min():.3g} mm away from {part.name}, which is {size:.3g} mm large: a body that "
            f"the part lies on touches it. Give both in the same coordinates and unit.{seen}",
            distance=float(distances.min()),
        )
    return body


def _placement(job: Job, cell: Cell, part: Surface, *, turnable: bool) -> tuple[Placement | None, Uncertainty | None]:
    """Return where the part stands, and how well that is known where it was measured and stated."""
    if not job.robot:
        return None, None
    if job.place == "demo":
        # What turns the part, or tilts it, makes less of where it starts.
        least = LEAST_MEAN_NORMAL if turnable or cell.table is not None else SHORTEST_MEAN_NORMAL
        found = demo_placement(part, position=cell.demo_position, rotation=cell.demo_turn, least=least)
        return replace(found, flow_unstated=cell.signals.flow_unstated), None
    calibration = calibrate_fixture(_fixture(cell))
    placement = replace(calibration.placement, flow_unstated=cell.signals.flow_unstated)
    if calibration.placement.missing:
        return placement, None
    uncertainty = surface_uncertainty(calibration, part)
    refuse_uncertain(uncertainty, standoff=cell.process.standoff, part=part.name)
    return placement, uncertainty


def surface_uncertainty(calibration: FixtureCalibration, part: Surface) -> Uncertainty:
    """Return how far a calibrated part's surface may lie off along its normal, where that is most."""
    T_base_work = calibration.placement.T_base_work
    normals = vertex_normals(part) @ T_base_work[:3, :3].T
    return normal_uncertainty(calibration, apply(T_base_work, part.vertices), normals=normals)


def _refined(sided: SidedPart, backends: Sequence[str], *, spacing: float) -> tuple[Surface, float]:
    """Return the part, each piece as finely as it needs alone, so that its paths do not depend on the others.

    Where fibres are narrower than the spacing, their width counts.

    The number is the shortest edge length [mm] that a backend wants of a piece.
    """
    factories = [backend(name).factory for name in backends]
    alone = [piece.surface for piece in pieces(sided.part)]
    spacing = least_spacing(sided.widths, spacing)
    wanted = [min(factory.edge_length(piece, spacing=spacing) for factory in factories) for piece in alone]
    refined = [refine(piece, edge_length=edge_length) for piece, edge_length in zip(alone, wanted, strict=True)]
    return united(refined), min(wanted)


def largest_distance(job: Job, part: Surface) -> float:
    """Return an estimate of the largest distance from the seed over the part [mm], before the spacing is known."""
    alone = [piece.surface for piece in pieces(part)]
    coarse = united([refine(piece, edge_length=_size(piece) / TRIANGLES_ACROSS) for piece in alone])
    return Piecewise(coarse, backend_of(job)).distance(seed_of(job, coarse)).maximum


def with_rounds(job: Job, cell: Cell) -> Job:
    """Return the job with the rounds of the cell where it names neither rounds nor spacing."""
    if job.spacing is not None or job.rounds is not None:
        return job
    return job.model_copy(update={"rounds": cell.process.rounds})


def _wanted_spacing(job: Job, part: Surface) -> float:
    """Return the spacing, or where rounds are given an estimate of it that is good enough to refine by.

    Raises:
        UsageError: neither is given; the sentence says what both would be on this part.
        FieldError: the spacing is larger than the part.
    """
    across = _size(part)
    if job.spacing is not None and job.spacing > across:
        raise FieldError(
            f"spacing is {job.spacing:g} mm, but the whole part is only {across:.3g} mm across: choose a smaller one."
        )
    if job.spacing is not None:
        return job.spacing
    depth = largest_distance(job, part)
    if job.rounds is None:
        raise UsageError(
            f"give `--spacing` or `--rounds`; on this part 10 rounds are about {depth / 10:.2g} mm, 20 about "
            f"{depth / 20:.2g} mm.",
            depth_mm=depth,
        )
    return depth / job.rounds


def _size(surface: Surface) -> float:
    """Return the diagonal of a surface's box [mm]."""
    return float(np.linalg.norm(np.ptp(surface.vertices, axis=0)))
