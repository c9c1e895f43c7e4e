"""`inspect`, `remesh` and `doctor`: a mesh file examined or given other triangles, and proof that the checks work."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from geoprint.config import load_cell
from geoprint.distance import backend as find_backend, backend_names
from geoprint.errors import GeoprintError, InputError, MeshError, UsageError, VerificationError, how_many, percent
from geoprint.geometry import (
    Inspection,
    Landmark,
    PreparationReport,
    boundary_half_edges,
    boundary_source,
    decimate,
    deviation,
    face_areas,
    face_normals,
    in_words,
    inspect,
    landmarks,
    middle_face,
    point_source,
    prepare,
    refine,
    remesh,
    signed_volume,
    smooth,
    terrace_height,
    triple,
    turned_over,
)
from geoprint.geometry.files import LabelFound, MeshFile, labels_of, load_file, load_likely, unit_hint
from geoprint.model import BoolArray, Reading, Source, Surface
from geoprint.reporting.html import made_with
from geoprint.results import FileInspection, Remeshed, VolumeInspection
from geoprint.robot.arm import Arm
from geoprint.robot.collision import arm_control, collision_control
from geoprint.transforms import inverse, rotation_angle
from geoprint.workflow.workpiece import inverted_in_words, shape_in_words

if TYPE_CHECKING:
    from geoprint.geometry.files.labelling import LabelVolume


# Versions, and positive controls: kinematics and collision check are made to prove themselves on this machine.


# Kinematics must come back to where they started within these [mm, rad].
POSITION_TOLERANCE = 1e-6
ANGLE_TOLERANCE = 1e-8
CONTROL_POSES = 1000


def examine() -> tuple[str, ...]:
    """Return a line for every package and every control.

    Raises:
        VerificationError: a control failed: do not trust programs made on this machine.
    """
    versions = tuple(f"{name:<20}{version}" for name, version in made_with())
    controls = (kinematics_control(), collision_control(), arm_control(load_cell(None).robot.model))
    return (*versions, *controls)


def kinematics_control() -> str:
    """Send random joint angles through forward and inverse kinematics and back.

    Raises:
        VerificationError: a solution does not lead back to its pose, or the known one is not among the eight.
    """
    robot = load_cell(None).robot
    arm = Arm(robot, T_flange_tool=load_cell(None).tool.T_flange_tool)
    joints = np.random.default_rng(0).uniform(robot.limits[:, 0], robot.limits[:, 1], (CONTROL_POSES, 6))
    wanted = arm.tool_poses(joints)
    solutions = arm.solutions(wanted)
    exists = np.isfinite(solutions).all(axis=2)
    found = arm.tool_poses(solutions[exists])
    wanted = np.repeat(wanted, exists.sum(axis=1), axis=0)
    position = float(np.linalg.norm(found[:, :3, 3] - wanted[:, :3, 3], axis=1).max())
    angle = float(rotation_angle(inverse(found)[:, :3, :3] @ wanted[:, :3, :3]).max())
    away = np.abs(np.angle(np.exp(1j * (solutions - joints[:, None])))).max(axis=2)
    missed = int((np.nanmin(away, axis=1) > ANGLE_TOLERANCE).sum())
    if position > POSITION_TOLERANCE or angle > ANGLE_TOLERANCE or missed:
        raise VerificationError(
            f"kinematics control failed: inverse solutions miss their pose by {position:.3g} mm and {angle:.3g} rad, "
            f"{missed} of {CONTROL_POSES} known joint vectors are not found; reinstall numba."
        )
    return (
        f"kinematics control passed: {int(exists.sum())} inverse solutions of {CONTROL_POSES} poses lead back within "
        f"{position:.1e} mm and {angle:.1e} rad"
    )


# One mesh file: examined, with what preparing changes and which backends can plan it, or given another mesh.


# Levels of the trial plan: coarse, since it only tries whether a backend accepts the surface.
TRIAL_LEVELS = 4
# And on triangles no larger than this share of the part's diagonal: planning refines what is coarser, too.
TRIAL_EDGE = 1.0 / 60.0
# Larger surfaces are not tried: that would take longer than everything else.
TRIAL_FACES = 100_000
NOT_TRIED = "not tried"
POSSIBLE = "yes"
# Without another word the surface may move by this share of the part's diagonal: 0.1 mm for a patch of 50 mm.
DEVIATION_SHARE = 1.0 / 500.0
# Of a label's surface, the least share that faces another label for it to be named.
LEAST_FACING = 0.03
ADVICE = "ask for shorter edges, more faces or less smoothing"


def inspect_file(
    path: Path | str,
    *,
    unit: str | None = None,
    label: int | None = None,
    threshold: float | None = None,
    longest_hole: float | None = None,
    observe: Callable[[str], None] = lambda _: None,
) -> FileInspection | VolumeInspection:
    """Examine a mesh file, or say which labels a volume holds.

    Args:
        path: of the file.
        unit: of its coordinates; where neither this nor the file says it, the likely one is assumed and said so.
        label: of a label volume, which one is meant; without it a volume of several is not made a mesh.
        threshold: of a volume of shares or probabilities, from which on a voxel belongs to a label.
        longest_hole: holes up to this long [mm] count as closed by preparing.
        observe: called with the name of each stage as it starts.

    Raises:
        UsageError: the unit is unknown or not that of the file, or the label is not in the file.
        InputError: the file cannot be read.
    """
    path = Path(path)
    observe("reading")
    labels, record, volume = labels_of(path, unit=unit, threshold=threshold) or ((), Reading({}, {}, ()), None)
    if len(labels) > 1 and label is None:
        return VolumeInspection(path.name, labels, None, record)
    try:
        loaded, assumed = load_likely(path, unit=unit, label=label, threshold=threshold)
    except InputError as error:
        if not labels:
            raise
        return VolumeInspection(path.name, labels, str(error), record)
    observe("examining")
    found = inspect(loaded.surface, longest_hole=longest_hole)
    return _inspection(path.name, loaded, found, observe, assumed=assumed, labels=labels, volume=volume, label=label)


def _inspection(
    name: str,
    loaded: MeshFile,
    found: Inspection,
    observe: Callable[[str], None],
    *,
    assumed: bool,
    labels: tuple[LabelFound, ...],
    volume: LabelVolume | None,
    label: int | None,
) -> FileInspection:
    """Return what is said of a file whose surface was examined."""
    used = found.examined.vertices[found.examined.faces.ravel()]
    return FileInspection(
        name=name,
        unit=loaded.unit,
        assumed=assumed,
        hint=unit_hint(found.examined, unit=loaded.unit),
        low=triple(used.min(axis=0)),
        high=triple(used.max(axis=0)),
        found=found,
        regions=_regions(loaded),
        side=_side(loaded.surface, found),
        terraces=None if found.refusal is not None else terrace_height(found.examined),
        backends=tuple(_trials(found, observe)),
        reading=loaded.reading,
        labels=labels,
        landmarks=() if found.refusal is not None else _landmarks(loaded, found, volume),
        label=next((one.label for one in labels if label in {None, one.label}), None),
    )


def _regions(loaded: MeshFile) -> tuple[tuple[str, int, float], ...]:
    """Return name, number of faces and area [mm2] of each region of a file."""
    areas = face_areas(loaded.surface)
    return tuple((name, faces.size, float(areas[faces].sum())) for name, faces in loaded.regions.items())


def _landmarks(loaded: MeshFile, found: Inspection, volume: LabelVolume | None) -> tuple[Landmark, ...]:
    """Return places on an examined surface, also of what each of a label's neighbours faces and of each region."""
    surface = found.examined
    if not found.rims and signed_volume(surface) < 0.0:
        surface = turned_over(surface)
    facing = {} if volume is None else _facing(surface, volume)
    named = [middle_face(loaded.surface, faces, name=f"region '{name}'") for name, faces in loaded.regions.items()]
    return (*landmarks(surface, regions=facing), *named)


def _facing(surface: Surface, volume: LabelVolume) -> dict[str, BoolArray]:
    """Return which faces of a label's surface face which label, one voxel out; those that are few are left out."""
    normals = face_normals(surface)
    steps = np.linalg.norm(normals @ np.linalg.inv(volume.affine[:3, :3]).T, axis=1)
    beyond = volume.at(surface.vertices[surface.faces].mean(axis=1) + normals / steps[:, None])
    areas = face_areas(surface)
    shares = {number: float(areas[beyond == number].sum() / areas.sum()) for number in np.unique(beyond).tolist()}
    ordered = sorted(shares.items(), key=lambda one: (-one[1], one[0]))
    return {
        f"facing {f'label {number}' if number else 'no label'}, {percent(share)}": beyond == number
        for number, share in ordered
        if share >= LEAST_FACING and share < 1.0
    }


def remesh_file(
    path: Path | str,
    *,
    unit: str | None = None,
    label: int | None = None,
    thin: bool = False,
    threshold: float | None = None,
    wavelength: float | None = None,
    edge_length: float | None = None,
    faces: int | None = None,
    max_deviation: float | None = None,
    observe: Callable[[str], None] = lambda _: None,
) -> Remeshed:
    """Prepare a part, smooth it and give it other triangles, as far as asked for; then measure what that has changed.

    Args:
        path: of the part's file.
        unit: of its coordinates.
        label: of a label volume, which one.
        thin: whether a label as thin as its voxels is taken with their terraces.
        threshold: of a volume of shares or probabilities, from which on a voxel belongs to a label.
        wavelength: as for `surfaces.smooth` [mm]; None leaves the noise.
        edge_length: as for `geometry` [mm].
        faces: as for `surfaces.decimate`, instead.
        max_deviation: how far the surfaces, and their rims, may lie apart [mm]; None for DEVIATION_SHARE of the part.
        observe: called with the name of each stage as it starts.

    Raises:
        UsageError: nothing is asked for, or edge length and faces both.
        InputError: the file cannot be used; or the new surface lies farther off than allowed, or cannot be planned on.
    """
    _check_asked(wavelength, edge_length, faces)
    observe("reading")
    before, preparation = prepare(load_file(path, unit=unit, label=label, thin=thin, threshold=threshold).surface)
    diagonal = float(np.linalg.norm(np.ptp(before.vertices, axis=0)))
    allowed = DEVIATION_SHARE * diagonal if max_deviation is None else max_deviation
    after, steps = _changed(before, wavelength, edge_length, faces, observe)
    observe("comparing")
    _check_topology(after, preparation)
    found = Remeshed(before, preparation, after, steps, deviation(before, after), allowed)
    _check_deviation(found)
    return found


def _check_asked(wavelength: float | None, edge_length: float | None, faces: int | None) -> None:
    if wavelength is None and edge_length is None and faces is None:
        raise UsageError("give `--edge-length MM` or `--faces N`, `--smooth MM`, or both kinds together.")
    if edge_length is not None and faces is not None:
        raise UsageError("give either `--edge-length` or `--faces`, not both: each sets the other.")


def _changed(
    part: Surface,
    wavelength: float | None,
    edge_length: float | None,
    faces: int | None,
    observe: Callable[[str], None],
) -> tuple[Surface, tuple[str, ...]]:
    """Return a part smoothed and with other triangles, as far as asked for, and the steps in words."""
    steps: list[str] = []
    if wavelength is not None:
        observe("smoothing")
        part = smooth(part, wavelength=wavelength)
        steps.append(f"smoothed below {wavelength:g} mm")
    if edge_length is not None:
        observe("triangulating")
        part = remesh(part, edge_length=edge_length)
        steps.append(f"remeshed to edges of {edge_length:g} mm")
    if faces is not None:
        observe("triangulating")
        part = decimate(part, faces=faces)
        steps.append(f"decimated to {how_many(faces, 'face')}")
    return part, tuple(steps)


def _side(filed: Surface, found: Inspection) -> str:
    """Return what tells which side of a surface is outside."""
    if found.refusal is not None:
        return "unknown until the mesh is repaired"
    if found.rims:
        return f"the side set by the file's winding, {shape_in_words(found.examined)}"
    return inverted_in_words(filed) or f"a closed surface of {signed_volume(filed) / 1000.0:.4g} cm3 shows it"


def _trials(found: Inspection, observe: Callable[[str], None]) -> Iterator[tuple[str, str]]:
    """Yield each backend's name and whether it plans on the surface."""
    for name in backend_names():
        observe(f"{name}: trial")
        yield name, _trial(name, found)


def _trial(name: str, found: Inspection) -> str:
    """Return whether a backend plans a few levels on the prepared surface, or its own words why not."""
    if found.refusal is not None:
        return "no: preparing refuses the mesh"
    surface = found.examined
    if len(surface.faces) > TRIAL_FACES:
        return f"{NOT_TRIED}: {how_many(len(surface.faces), 'face')}, {TRIAL_FACES} at most are tried; plan it"
    diagonal = float(np.linalg.norm(np.ptp(surface.vertices, axis=0)))
    try:
        surface = refine(surface, edge_length=TRIAL_EDGE * diagonal)
        backend, source = find_backend(name).factory(surface), _source(surface)
        backend.contours(source, spacing=backend.distance(source).maximum / TRIAL_LEVELS)
    except GeoprintError as error:
        return f"no: {error}"
    return (
        POSSIBLE if boundary_half_edges(surface.faces).size else f"{POSSIBLE}, with `--from point:X,Y,Z`: it is closed"
    )


def _source(surface: Surface) -> Source:
    """Return the border, or some point of a closed surface."""
    if boundary_half_edges(surface.faces).size:
        return boundary_source(surface)
    return point_source(surface, surface.vertices[surface.faces[0, 0]])


def _check_topology(after: Surface, preparation: PreparationReport) -> None:
    """Refuse a mesh that planning would refuse, or repair into another kind of surface."""
    try:
        topology = prepare(after)[1].topology
    except MeshError as error:
        raise InputError(f"the new mesh cannot be planned on: {str(error).rstrip('.')}; {ADVICE}.") from error
    if topology != preparation.topology:
        raise InputError(
            f"the new mesh of {after.name} would be {topology}, the part is {preparation.topology}: its smallest "
            f"holes, handles or walls are lost; {ADVICE}."
        )


def _check_deviation(found: Remeshed) -> None:
    """Refuse a mesh that lies farther from the part than is allowed."""
    worst, rim = found.deviation.largest, found.deviation.rim
    deviates = max(worst.bound, rim)
    if deviates <= found.allowed:
        return
    where = f"at {in_words(worst.place)}" if worst.bound >= rim else "at a rim"
    raise InputError(
        f"{found.before.name}, {' and '.join(found.steps)}, lies up to {deviates:.3g} mm off, {where}; at most "
        f"{found.allowed:.3g} mm is allowed: {ADVICE}, or allow it with `--max-deviation {1.1 * deviates:.2g}`.",
        deviation=deviates,
        allowed=found.allowed,
        place=worst.place,
    )
