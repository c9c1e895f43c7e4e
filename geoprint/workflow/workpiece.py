"""What is planned on: cell, part and body as read, its printed side, where it stands, and the part refined.

The printed side is that of the file's winding, unless the body that the part lies on tells another.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Protocol, final

import numpy as np

from geoprint.config import Job, WidthTable, cell_text, job_cell, read_field, stored_field
from geoprint.distance import Piecewise, backend
from geoprint.errors import Faults, FieldError, InputError, MeshError, UsageError, percent
from geoprint.geometry import (
    boundary_half_edges,
    closest,
    closest_once,
    encloses,
    face_areas,
    face_normals,
    in_words,
    part_of,
    pieces,
    prepare,
    refine,
    signed_volume,
    stays_open,
    turned_over,
    united,
    vertex_normals,
)
from geoprint.geometry.files import MeshFile, load_file, load_likely, unit_readings
from geoprint.model import Cell, FloatArray, Placement, Surface, TouchedPoints, frozen
from geoprint.postprocessor.registry import post_processor_of
from geoprint.process import WidthRule, WidthsAbout, WidthsAlong, WidthsBetween, WidthsOver, strand_diameter
from geoprint.reporting.divisions import division_of
from geoprint.results import Side, StackPlace, Workpiece
from geoprint.robot.arm import Arm, check_load
from geoprint.robot.collision import link_solids
from geoprint.robot.placing import (
    LEAST_MEAN_NORMAL,
    SHORTEST_MEAN_NORMAL,
    FixtureCalibration,
    Uncertainty,
    calibrate_fixture,
    demo_placement,
    normal_uncertainty,
    refuse_uncertain,
)
from geoprint.transforms import apply
from geoprint.workflow.backend_choice import backend_of, check_part, follows_field
from geoprint.workflow.feedback import feedback_text
from geoprint.workflow.number_tables import check_on_part, read_widths
from geoprint.workflow.patches import PreparedPart, prepared_part
from geoprint.workflow.sources import source_of, with_best_sources
from geoprint.workflow.stages import Stages

# Which side of a part is printed on: as the file winds it, unless the body that the part lies on tells otherwise.


# A patch bulges, or is hollow, where the volume of the cone from its middle is beyond this share of area times size: a
# cap of a ball that is as high as a fiftieth of its width.
LEAST_BULGE = 0.004
# The body tells the side where at least this share of the part's area agrees; between, it tells nothing.
TELLING_SHARE = 0.9


def printed_side(
    part: Surface,
    body: Surface | None,
    *,
    flip: bool,
    filed: Surface | None = None,
    cut: bool = False,
) -> tuple[Surface, Side]:
    """Decide which side is printed on, and turn the part where the body tells that it is inside out.

    Args:
        part: as prepared, turned already where `flip` says so.
        body: what it lies on; only a closed one tells its outside.
        flip: whether the user turned the file's winding; then the body only warns.
        filed: the body as its file winds it, or the part where there is no body; None where nobody knows.
        cut: whether the part was cut from the body, which is then joined already, and sound where the part lies.

    Returns:
        The part, and how its side was found.
    """
    if boundary_half_edges(part.faces).size == 0:
        where = "inside of a closed surface, as `--flip` asks" if flip else "outside of a closed surface"
        return part, Side("closed", flip, None, f"printing on the {where}.{_also(filed)}")
    agreeing = None if body is None else _agreeing(part, body, cut=cut)
    source = "flip" if flip else "winding"
    record = "the side chosen by `--flip`" if flip else "the side that the normals face"
    if agreeing is None:
        other = "Omit `--flip` for the other side" if flip else "`--flip` for the other side"
        sentence = f"printing on {record}, {shape_in_words(part)}. {other}; a closed `--body` confirms it."
        return part, Side(source, flip, None, sentence)
    name = body.name if body is not None else ""
    if agreeing >= TELLING_SHARE:
        sentence = f"printing on the side that faces out of {name} ({percent(agreeing)} of it).{_also(filed)}"
        return part, Side("body", flip, agreeing, sentence)
    share = f"{percent(1 - agreeing)} of it faces into {name}"
    if agreeing > 1 - TELLING_SHARE or flip:
        return part, Side(source, flip, agreeing, f"printing on {record}, but {share}: check the side.")
    sentence = f"printing on the other side than the normals face, where {share}.{_also(filed)}"
    return turned_over(part), Side(source="body", turned=True, agreeing=1 - agreeing, sentence=sentence)


def shape_in_words(part: Surface) -> str:
    """Return what the shape shows of the side of an open patch: parts bulge out of what they are of, if they curve."""
    size = float(np.linalg.norm(np.ptp(part.vertices, axis=0)))
    bulge = signed_volume(part) / (size * float(face_areas(part).sum()))
    if bulge < -LEAST_BULGE:
        return "which is hollow: check whether the file is mirrored or its faces are flipped"
    return "which bulges" if bulge > LEAST_BULGE else "which is flat on average"


def _also(filed: Surface | None) -> str:
    """Return a sentence where the file of a closed body is inside out."""
    words = "" if filed is None else inverted_in_words(filed)
    return f" But {words}" if words else ""


def inverted_in_words(filed: Surface) -> str:
    """Return what is to be said of a closed file whose faces look inward; nothing where they do not."""
    volume = signed_volume(filed) / 1000.0
    if volume >= 0.0:
        return ""
    return (
        f"the volume of {filed.name} is {volume:.3g} cm3: either all faces are flipped, which is corrected, or the "
        "part is mirrored, which is not. Check left and right, and export it again if mirrored."
    )


def _agreeing(part: Surface, body: Surface, *, cut: bool) -> float | None:
    """Return the share of the part's area whose normal is within 90 degrees of the body's below it."""
    outward = _outward(body, cut=cut)
    if outward is None:
        return None
    middles = part.vertices[part.faces].mean(axis=1)
    below, _ = closest_once(outward, middles)
    under = part_of(outward, np.isin(np.arange(len(outward.faces)), below.faces))
    rank = np.searchsorted(np.unique(below.faces), below.faces)
    along = np.einsum("mx,mx->m", face_normals(under)[rank], face_normals(part))
    areas = face_areas(part)
    return float(areas[along > 0].sum() / areas.sum())


def _outward(body: Surface, *, cut: bool) -> Surface | None:
    """Return a body with its faces outward; None where it is open or cannot be prepared.

    What a part was cut from is not looked at for crossings, which far from the part do no harm, and where it stays
    open nothing is prepared.
    """
    if cut and encloses(body.faces):
        return body if signed_volume(body) > 0 else turned_over(body)
    try:
        if cut and stays_open(body):
            return None
        outward, _ = prepare(body)
    except MeshError:
        return None
    return None if boundary_half_edges(outward.faces).size else outward


# How wide the fibres of a job are over its part, and whether its cell can deposit them.


# A width may be beyond what a cell deposits by this share: what is written has few digits.
ROUNDING = 1e-9
# A part that measures less along a direction [mm] does not extend along it.
SHORTEST = 1e-6


def widths_of(job: Job, part: Surface, place: StackPlace | None) -> WidthsOver | None:
    """Return how wide the fibres of a job are; None where all of its paths are one spacing wide.

    Args:
        job: its field file may have a table of it.
        part: that is planned on; of a layer its middle.
        place: of that layer, which has the widths of the part below it; None of a single skin.

    Raises:
        UsageError: the job has no spacing that widths could be held against, or as `read_field`.
        InputError: a table cannot be read, or one of its points lies off the part.
    """
    if job.field is None or not follows_field(job):
        return None
    table = read_field(job.field).width
    if table is None:
        return None
    if job.spacing is None:
        raise UsageError(f"{job.field.name}: [width] is relative to the spacing: give `--spacing`, and no rounds.")
    base = part if place is None else place.base
    return WidthsOver(_rule(table, base, spacing=job.spacing), None if place is None else base)


def check_widths(widths: WidthsOver, job: Job, cell: Cell, place: StackPlace | None) -> None:
    """Check that a cell can deposit the widths that a job asks for.

    Its flow follows from least to most of that of one spacing, and the strand must not be thinner than the stand-off:
    nothing presses it on then.

    Args:
        widths: of the job, which has a spacing.
        job: whose program they may be of.
        cell: as its file has it.
        place: of a layer, whose height counts instead of the cell's.

    Raises:
        UsageError: a program is asked for, and the cell cannot change its flow.
        InputError: a width is beyond what the cell can deposit; says where.
    """
    assert job.spacing is not None  # noqa: S101  # Widths have one.
    name, process = "[width]" if job.field is None else f"{job.field.name}: [width]", cell.process
    if job.robot and cell.signals.mode != "analog":
        raise UsageError(
            f"{name} changes the width of fibres, but the cell {cell.name} can only open and shut its valve "
            '(signals.mode "io"). Give a cell with mode "analog", add `--no-robot`, or remove [width].'
        )
    least, most = process.least_flow * job.spacing, process.most_flow * job.spacing
    places, values = widths.rule.ends()
    worst = int(np.argmax(np.maximum(least - values, values - most)))
    width, where = float(values[worst]), f"{name} asks for {values[worst]:.4g} mm at {in_words(places[worst])}"
    if not least * (1.0 - ROUNDING) <= width <= most * (1.0 + ROUNDING):
        raise InputError(
            f"{where}, but at a spacing of {job.spacing:g} mm the cell {cell.name} deposits {least:.4g} to {most:.4g} "
            f"mm ([process] least_flow_share {process.least_flow:g} and most_flow_share {process.most_flow:g}). Ask "
            "for a width between them, or choose another spacing.",
            width=width, least=least, most=most,
        )  # fmt: skip
    thinnest = int(np.argmin(values))
    height = process.layer_height if place is None else place.height
    strand = strand_diameter(float(values[thinnest]) * height)
    if strand < process.standoff:
        raise InputError(
            f"{name} asks for {values[thinnest]:.4g} mm at {in_words(places[thinnest])}, a strand of {strand:.3g} mm "
            f"in layers of {height:.3g} mm. The stand-off of the cell {cell.name} is {process.standoff:g} mm, so "
            "nothing presses it on: ask for more there, or print nearer.",
            width=float(values[thinnest]), strand=strand, standoff=process.standoff,
        )  # fmt: skip


def least_spacing(widths: WidthsOver | None, spacing: float) -> float:
    """Return the least distance of paths of a spacing [mm], by which their surface is refined."""
    return spacing if widths is None else min(spacing, float(widths.rule.ends()[1].min()))


def _rule(table: WidthTable, base: Surface, *, spacing: float) -> WidthRule:
    """Return the widths that a table gives to a part."""
    if table.table is not None:
        places, values = read_widths(table.table)
        check_on_part(places, base, name=Path(table.table).name)
        return WidthsBetween(places, values)
    if table.places is not None and table.at_mm is not None and table.within_mm is not None:
        places = np.array(table.places)
        check_on_part(places, base, name="[width]")
        return WidthsAbout(places, table.at_mm, table.within_mm, spacing)
    widths = np.array([table.begin_mm, table.end_mm], dtype=np.float64)
    return _along(base, np.array(table.direction, dtype=np.float64), widths)


def _along(base: Surface, direction: FloatArray, widths: FloatArray) -> WidthsAlong:
    """Return widths that change along a direction.

    Raises:
        InputError: the part is flat along it, so that it neither begins nor ends.
    """
    unit = direction / np.linalg.norm(direction)
    heights = base.vertices @ unit
    if np.ptp(heights) < SHORTEST:
        raise InputError(
            f"[width] changes along {direction.tolist()}, but {base.name} measures {np.ptp(heights):.2g} mm along it: "
            "give a direction along which it extends."
        )
    return WidthsAlong(base.vertices[heights.argmin()], base.vertices[heights.argmax()], unit, widths)


# Suffixes of files that may carry no unit, and are read at once.
WITHOUT_UNIT = frozenset({".stl", ".obj", ".ply", ".off", ".zip"})
# Resolution at which the largest distance is estimated before the spacing is known, in triangles across the part.
TRIANGLES_ACROSS = 60
# A mirrored part lies on the body but for this share of its size.
MIRRORED_SHARE = 0.05


# Keys of a job of which neither its cell nor its part depends, but for those that layers and fields with widths read.
AFTER_READING = {
    "backend", "compared", "middle", "contours", "spacing", "rounds", "source", "options", "place", "robot", "max_tilt",
    "on_slowdown", "accept_flow", "feedback",
}  # fmt: skip
READ_BY_LAYERS = {"spacing", "robot"}


def reading_keys(job: Job) -> dict[str, object]:
    """Return the keys of a job that its cell and its part depend on, as `read_cell_and_part` returns them."""
    special = READ_BY_LAYERS if job.layered or job.field is not None else set[str]()
    return {name: value for name, value in job if name not in AFTER_READING or name in special}


class Refined(Protocol):
    """What `refined_part` is."""

    def __call__(self, sided: SidedPart, backends: Sequence[str], /, *, spacing: float) -> tuple[Surface, float]:
        """Return the part as finely as it is needed, and the shortest edge length [mm] that a backend wants of it."""
        ...


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
    cell, sided = read_cell_and_part(job, stage)
    return workpiece_of(job, stage, cell=cell, sided=sided, backends=backends)


def read_cell_and_part(job: Job, stage: Stages) -> tuple[Cell, SidedPart]:
    """Read the cell of a job, and its part, which depend on its `reading_keys` alone.

    Raises:
        UsageError: the job or its cell is unclear or contradicts itself.
        InputError: a file cannot be planned on.
    """
    with stage("reading"):
        cell = job_cell(job)
        job = with_rounds(job, cell)
        return cell, sided_part(job, _loaded(job, cell), cell)


def workpiece_of(
    job: Job,
    stage: Stages,
    *,
    cell: Cell,
    sided: SidedPart,
    backends: Sequence[str],
    refined: Refined | None = None,
) -> Workpiece:
    """Return what `prepare_workpiece` does of a cell and a part that were read.

    Args:
        job: what to plan.
        stage: names and times the work.
        cell: of the job.
        sided: its part.
        backends: that shall plan on it.
        refined: returns what `refined_part` does, by default that.
    """
    job, refined = with_rounds(job, cell), refined or refined_part
    with stage("refining"):
        turnable = _turnable(job, cell, sided)
        cell = replace(cell, demo_rotation=cell.demo_turn)
        placement, uncertainty = _placement(job, cell, sided.base, turnable=turnable)
        surface, edge_length = refined(sided, backends, spacing=_wanted_spacing(job, sided.part))
        workpiece = Workpiece(
            cell=stack_cell(cell, sided.place),
            part=sided.part,
            side=sided.side,
            body=sided.body,
            files=sided.files,
            cell_text=None if job.cell is None else cell_text(job.cell),
            patches=sided.prepared.patches,
            preparations=sided.prepared.preparations,
            edge_length=edge_length,
            surface=surface,
            source=source_of(job, surface, base=None if sided.place is None else sided.place.base),
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


def _loaded(job: Job, cell: Cell) -> MeshFile:
    """Read the part of a job that says all that it must.

    It is looked at in the order in which a person thinks, cell, unit, spacing, placement, and before the long work. A
    large file is parsed only for a job that says what can be said without it.
    """
    if job.unit is not None and (job.spacing is not None or job.rounds is not None):
        require_placement(job, cell)
    loaded = load_file(job.surface, unit=job.unit, label=job.label, threshold=job.threshold)
    if job.rounds is None:
        _wanted_spacing(job, loaded.surface if job.spacing is not None else prepared_part(job, loaded).surface)
    require_placement(job, cell)
    return loaded


def check_stated(job: Job, *, proposed_folder: str | None = None) -> None:
    """Check that a job leaves nothing open that nobody can guess; its part is read only where something is missing.

    Args:
        job: what to plan.
        proposed_folder: for the result, where none was given; None where one was.

    Raises:
        UsageError: unit, spacing, placement or folder are missing; one message names all of them, with what to add.
        InputError: the part cannot be planned on, whatever else is said of it.
    """
    check_part(job)
    cell = job_cell(job)
    job = with_rounds(job, cell)
    spaced = job.spacing is not None or job.rounds is not None
    placed = not job.robot or job.place is not None or cell.fixture is not None
    whole = spaced and placed and proposed_folder is None
    if whole and (job.unit is not None or job.surface.suffix.lower() not in WITHOUT_UNIT):
        return
    file, guessed = load_likely(job.surface, unit=job.unit, label=job.label, threshold=job.threshold)
    if whole and not guessed:
        return
    part = prepared_part(job, file).surface
    missing: list[tuple[str, str, str]] = []
    if guessed:
        extents = np.ptp(file.vertices[file.faces.ravel()], axis=0)
        missing.append(("--unit", file.unit, f"{unit_readings(file.name, extents)}."))
    depth = None if spaced else largest_distance(job, part)
    if depth is None:
        source_of(job, part)
    else:
        rounds = f"10 rounds are about {depth / 10:.2g} mm apart on this part, 20 about {depth / 20:.2g} mm."
        missing.append(("--spacing", f"{depth / 10:.2g}", rounds))
    if not placed:
        dry = f"The cell {cell.name} is not calibrated: `--place demo` runs only dry, `--no-robot` plans paths alone."
        missing.append(("--place", "demo", dry))
    if proposed_folder is not None:
        missing.append(("--out", proposed_folder, ""))
    raise UsageError(_missing(missing), depth_mm=depth)


def _missing(missing: Sequence[tuple[str, str, str]]) -> str:
    """Return what is missing of a job: options, what could be given for them, and what is to be said of each."""
    flags = [f"`{flag}`" for flag, _, _ in missing]
    named = " and ".join([", ".join(flags[:-1]), flags[-1]] if len(flags) > 1 else flags)
    said = " ".join(sentence for *_, sentence in missing if sentence)
    added = " ".join(f"{flag} {value}" for flag, value, _ in missing)
    verb = "is" if len(missing) == 1 else "are"
    return f"{named} {verb} missing. {f'{said} ' if said else ''}Add `{added}`, for example."


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
        widths: how wide fibres are, which the cell can deposit; None where they are one spacing wide.
    """

    files: tuple[MeshFile, ...]
    prepared: PreparedPart
    part: Surface
    side: Side
    body: Surface | None
    place: StackPlace | None = None
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
    sided, division = _skin(job, loaded), division_of(job)
    if division is not None:
        place, surface = division.place(job, cell, sided.part)
        # What the layers below are made of lies between the part and the middle of this one.
        sided = replace(sided, part=surface, body=sided.body or sided.part, place=place)
    widths = widths_of(job, sided.part, sided.place)
    if widths is not None:
        check_widths(widths, job, cell, sided.place)
    return replace(sided, widths=widths)


def read_skin(job: Job) -> SidedPart:
    """Return what `read_part` does of the part itself, whatever layers lie on it.

    Raises:
        UsageError: as `read_part`.
        InputError: as `read_part`.
    """
    return _skin(job, load_file(job.surface, unit=job.unit, label=job.label, threshold=job.threshold))


def stack_cell(cell: Cell, place: StackPlace | None) -> Cell:
    """Return a cell for a layer, with its height; the stand-off stays that from what the layer lies on."""
    return cell if place is None else replace(cell, process=replace(cell.process, layer_height=place.height))


def _skin(job: Job, loaded: MeshFile) -> SidedPart:
    """Return the part itself, whatever layers lie on it."""
    prepared = prepared_part(job, loaded)
    named = None if job.body is None else load_file(job.body, unit=job.unit)
    body = prepared.body if named is None else _body(prepared.surface, named.surface)
    asked = turned_over(prepared.surface) if job.flip else prepared.surface
    filed, cut = (named or loaded).surface, named is None and body is not None
    part, side = printed_side(asked, body, flip=job.flip, filed=filed, cut=cut)
    if (job.keep_outs or job.margin) and named is not None and body is not None and prepared.body is not None:
        # What stays empty is no part, and still there to be hit.
        body = united([body, prepared.body])
    files = (loaded,) if named is None else (loaded, named)
    return SidedPart(files, prepared, part, side, body)


def require_placement(job: Job, cell: Cell) -> None:
    """Refuse, before the long work, a cell from which no program can come; list all that stands against it."""
    if not job.robot:
        return
    if job.place == "best":
        raise UsageError("find the placement 'best' before planning: `best_placed(job)` returns the job there.")
    if job.place is None:
        _fixture(cell)
    writing, faults = post_processor_of(cell), Faults()
    with faults.noting():
        writing.check_cell(cell)
    with faults.noting():
        link_solids(cell.robot.model, urdf=cell.robot.urdf, flange=cell.robot.flange)
    with faults.noting():
        arm = Arm(cell.robot, T_flange_tool=cell.tool.T_flange_tool)
        with faults.noting():
            writing.check_arm(arm)
        check_load(cell.tool, arm)
    faults.refuse(f"nothing can be planned with the cell {cell.name}")


def _fixture(cell: Cell) -> TouchedPoints:
    """Return the touched points of a calibrated cell."""
    if cell.fixture is None:
        raise UsageError(
            f"the cell {cell.name} is not calibrated, so the placement of the part is unknown. Touch four or more "
            "points of its fixture (`geoprint calibrate` fits them). Or add `--place demo` for a dry run, or "
            "`--no-robot` for the paths only."
        )
    return cell.fixture


def _body(part: Surface, body: Surface) -> Surface:
    """Return the body; one that lies farther from the part than the part is large is another's, or in another unit."""
    _, distances = closest(body, part.vertices)
    size = _size(part)
    if distances.min() > size:
        mirrors = zip("xyz", part.vertices * (1.0 - 2.0 * np.eye(3))[:, None], strict=True)
        on = [axis for axis, mirrored in mirrors if closest(body, mirrored)[1].max() < MIRRORED_SHARE * size]
        seen = f" Mirrored in {on[0]}, it lies on it: one file is left-handed, so export it again." if on else ""
        raise InputError(
            f"{body.name} is {distances.min():.3g} mm away from {part.name}, which is {size:.3g} mm large: the body "
            f"under a part must touch it. Give both in the same coordinates and unit.{seen}",
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


def refined_part(sided: SidedPart, backends: Sequence[str], /, *, spacing: float) -> tuple[Surface, float]:
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
    """Return an estimate of the largest distance from the source over the part [mm], before the spacing is known."""
    alone = [piece.surface for piece in pieces(part)]
    coarse = united([refine(piece, edge_length=_size(piece) / TRIANGLES_ACROSS) for piece in alone])
    return Piecewise(coarse, backend_of(job)).distance(source_of(job, coarse)).maximum


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
            f"spacing is {job.spacing:g} mm, but the part is only {across:.3g} mm across: choose a smaller one."
        )
    if job.spacing is not None:
        return job.spacing
    depth = largest_distance(job, part)
    if job.rounds is None:
        raise UsageError(
            f"give `--spacing` or `--rounds`; on this part, 10 rounds are about {depth / 10:.2g} mm, 20 about "
            f"{depth / 20:.2g} mm.",
            depth_mm=depth,
        )
    return depth / job.rounds


def _size(surface: Surface) -> float:
    """Return the diagonal of a surface's box [mm]."""
    return float(np.linalg.norm(np.ptp(surface.vertices, axis=0)))
