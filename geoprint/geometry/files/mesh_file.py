"""What a reader makes of a file: a mesh, its unit and precision, how it was made, and the regions that it names.

It is stored as PLY with all of that: vertices to the last bit, in the file's own unit, regions as a property of faces,
and in a comment the file's name, hash, unit and how the mesh was made. Read again it is the same mesh, under the name
of that file. The comment counts only while the vertices and faces are those that it was written for.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import field, replace
from functools import lru_cache
from types import MappingProxyType
from typing import Any, TypeAlias, cast, final

import numpy as np

from geoprint.errors import InputError, UsageError
from geoprint.model import FloatArray, IntArray, Reading, Rounded, Surface, frozen, recorded

# How a file that is not a mesh was turned into one, and the packages that this needs.


# Names and values that say how a mesh was made, as the plan's record keeps them.
Notes: TypeAlias = tuple[tuple[str, str | float | int], ...]


# Named regions of a mesh: the groups, objects, solids and labels that its file gives to faces.


# The faces of each region, ascending; a face may lie in several regions or in none.
Regions: TypeAlias = Mapping[str, IntArray]

# A property with more values than this numbers things, it does not label them.
MOST_LABELS = 1000
# What integer properties that are no labels are called, or end in after a line: colours, and marks of an editor.
NO_LABELS = ("red", "green", "blue", "alpha", "flags")
# The label of a face that has none.
NONE = np.iinfo(np.int64).min
# Regions that a message lists.
MOST_NAMED = 20
# Part of a name that is shown.
LONGEST_NAME = 60


def named(names: Sequence[str], which: IntArray) -> Regions:
    """Return the regions of faces that each carry one name.

    Args:
        names: of r regions; equal ones are one region. Signs that cannot be printed are replaced.
        which: (m,) index of each face's name, -1 for none.
    """
    shown = [printable(name) for name in names]
    unique = {name: index for index, name in enumerate(dict.fromkeys(shown))}
    merged = np.array([unique[name] for name in shown] + [-1])[which]
    faces = np.argsort(merged, kind="stable")
    starts = np.searchsorted(merged[faces], np.arange(len(unique) + 1))
    parts = {name: faces[starts[index] : starts[index + 1]] for name, index in unique.items()}
    return {name: part for name, part in parts.items() if part.size}


def labelled(name: str, values: IntArray) -> Regions:
    """Return the regions `name=value` of (m,) labels of faces or NONE; none where there are too many values."""
    found, which = np.unique(values, return_inverse=True)
    if found.size > MOST_LABELS:
        return {}
    regions = named([f"{name}={value}" for value in found.tolist()], which)
    return {key: faces for key, faces in regions.items() if values[faces[0]] != NONE}


def labelled_faces(
    faces: IntArray, *, of_faces: Mapping[str, IntArray], of_vertices: Mapping[str, IntArray]
) -> Regions:
    """Return the regions that integer properties of faces and vertices make.

    Args:
        faces: (m, 3).
        of_faces: (m,) values of each property of faces.
        of_vertices: (n,) values of each property of vertices; a face has that of its vertices where all three agree.
    """
    corners = {name: values[faces] for name, values in of_vertices.items()}
    agreed = {name: np.where((label == label[:, :1]).all(axis=1), label[:, 0], NONE) for name, label in corners.items()}
    regions: dict[str, IntArray] = {}
    for kind, properties, others in (("face", of_faces, agreed), ("vertex", agreed, of_faces)):
        for name, values in properties.items():
            if name.lower().rpartition("_")[2] not in NO_LABELS:
                regions |= labelled(f"{kind} {name}" if name in others else name, values)
    return regions


def together(kinds: Iterable[tuple[str, Regions]]) -> Regions:
    """Return the regions of several kinds; a name that several kinds have is preceded by its kind."""
    kinds = list(kinds)
    uses = Counter(name for _, regions in kinds for name in regions)
    return {
        (name if uses[name] == 1 else f"{kind} {name}"): faces
        for kind, regions in kinds
        for name, faces in regions.items()
    }


def region_faces(regions: Regions, name: str, *, file: str) -> IntArray:
    """Return the faces of a region.

    Args:
        regions: that a file has.
        name: of one of them.
        file: its name.

    Raises:
        UsageError: there is none of that name; the sentence lists those that there are.
    """
    if name in regions:
        return regions[name]
    if not regions:
        raise UsageError(
            f"{file} has no regions: groups, objects and materials of OBJ, solids of STL, objects of 3MF and integer "
            "labels of PLY are read. Cut the patch with `geoprint patch` and `--at`, `--box` or `--curve`."
        )
    listed = ", ".join(f"'{each[:LONGEST_NAME]}'" for each in list(regions)[:MOST_NAMED])
    more = f" and {len(regions) - MOST_NAMED} more" if len(regions) > MOST_NAMED else ""
    raise UsageError(f"{file} has no region '{name[:LONGEST_NAME]}'; it has {listed}{more}.")


def printable(name: str) -> str:
    """Return a name in one line whose signs can all be printed."""
    line = " ".join(name.split())
    return "".join(sign if sign.isprintable() else "\N{REPLACEMENT CHARACTER}" for sign in line)


# Asked with places, the unit that the file says and the usual one, each perhaps empty, before anything is made of the
# places: raises where the unit is missing, is another than the file says, or makes the part too small or large.
Check: TypeAlias = Callable[[FloatArray, str, str], None]

# Millimetres in each unit; the order is that of likelihood, which decides between units that are equally plausible.
UNITS: Mapping[str, float] = MappingProxyType({"mm": 1.0, "m": 1000.0, "in": 25.4, "cm": 10.0, "um": 0.001})
# Where the steps between neighbouring coordinates exceed this share of the part's size, vertices of a fine mesh fall
# together: in single precision a part of 40 mm may lie up to 33 m from the origin.
RESOLUTION_SHARE = 1e-4
# So much of a text tells how its numbers are written [bytes].
SAMPLE = 1 << 16
WRITTEN = re.compile(rb"[-+]?\d+\.(\d+)(?:[eE]([-+]?\d{1,3}))?")

# The comment of a stored mesh, and the word that ends a header.
ORIGIN = b"comment geoprint read this mesh: "
_END = "end_header"
# The property of a face that says which regions it lies in, by its place in the comment's list of such sets.
_KIND = "regions"


@final
@frozen
class Choice:
    """What is asked of a label volume.

    Attributes:
        label: which one is meant; None where nobody has chosen.
        thin: whether one as thin as its voxels is taken with their terraces.
        threshold: the share or probability from which on a voxel belongs to a label; None for the usual one.
        check: is asked about the voxels' places before they are made a mesh.
    """

    label: int | None = None
    thin: bool = False
    threshold: float | None = None
    check: Check | None = None


@final
@recorded("ContactRecord")
class Contact:
    """A label that another touches.

    Attributes:
        label: its number.
        share: of the sides of the other's voxels that lead out of that, by area, those that lead into this one.
    """

    label: int
    share: Rounded


@final
@recorded("LabelRecord", volume="volume_mm3", low="low_mm", high="high_mm")
class LabelFound:
    """A label of a volume.

    Attributes:
        label: its number.
        name: that the file gives it, or empty.
        voxels: how many it has.
        volume: of these [mm3].
        low: (3,) lowest, and
        high: (3,) highest coordinates of its voxels in the part's coordinates [mm].
        touches: other labels, the largest share first. What is left leads into no label.
        inside: the label in which it lies: one that it touches over more than half of its surface, and whose box holds
            its own; None where there is none such.
    """

    label: int
    name: str
    voxels: int
    volume: Rounded
    low: tuple[Rounded, ...]
    high: tuple[Rounded, ...]
    touches: tuple[Contact, ...]
    inside: int | None


@final
@frozen
class MeshFile:
    """A mesh as a file holds it, or as it was made of what a file holds.

    Attributes:
        vertices: (n, 3) positions in the file's unit.
        faces: (m, 3) vertex indices, counter-clockwise from outside; polygons are triangulated.
        unit: of the positions, a key of UNITS; empty where the format carries none and nobody has said it.
        usual: the unit that such a file has where it says none; empty where there is none such.
        notes: how the mesh was made, where the file holds something else.
        regions: groups, objects, solids and labels that the file gives to faces.
        name: of the file, or of the one that a stored mesh was read from.
        digest: SHA-256 of the bytes of that file; empty where there was none.
        label: that was asked for of a label volume, or None.
        step: between neighbouring numbers that the file can hold where the mesh lies, in its unit; 0 where these are of
            double precision.
        reading: what was used of the file, skipped and assumed; empty where a stored mesh was read.
    """

    vertices: FloatArray
    faces: IntArray
    unit: str = ""
    notes: Notes = ()
    regions: Regions = field(default_factory=dict[str, IntArray])
    name: str = "surface"
    digest: str = ""
    label: int | None = None
    step: float = 0.0
    reading: Reading = Reading({}, {}, ())
    usual: str = ""

    @property
    def surface(self) -> Surface:
        """Return the mesh in mm, named after the file.

        Raises:
            InputError: the unit is not known.
        """
        if not self.unit:
            raise InputError(f"`{self.name}` has no unit; give it with `--unit`.")
        # In mm the vertices are shared: those of a large file are most of its memory.
        vertices = self.vertices if UNITS[self.unit] == 1.0 else self.vertices * UNITS[self.unit]
        return Surface(vertices=vertices, faces=self.faces, name=self.name)


def check_indices(faces: IntArray, *, vertices: int, name: str) -> None:
    """Refuse faces that refer to vertices which are not in the file.

    Raises:
        InputError: an index is negative, or not below the number of vertices.
    """
    wrong = (faces < 0) | (faces >= vertices)
    if wrong.any():
        face = int(np.argmax(wrong.any(axis=1)))
        raise InputError(
            f"`{name}`: face {face} refers to vertex {faces[wrong][0]}, but there are {vertices} vertices, numbered "
            "from 0; the file is damaged, so export it again.",
            face=face,
            vertex=int(faces[wrong][0]),
            vertices=vertices,
        )


def check_mesh(file: MeshFile, *, name: str) -> None:
    """Refuse a mesh without faces, with faces that refer to nothing, or with coordinates that are not finite."""
    if len(file.faces) == 0:
        raise InputError(f"`{name}` holds no faces; a surface needs triangles, so export it as a mesh.")
    check_indices(file.faces, vertices=len(file.vertices), name=name)
    broken = ~np.isfinite(file.vertices).all(axis=1)
    if broken.any():
        raise InputError(
            f"`{name}`: vertices with NaN or infinite coordinates: {int(broken.sum())}, the first is vertex "
            f"{int(np.argmax(broken))}; repair the mesh where it was made.",
            vertices=int(broken.sum()),
            vertex=int(np.argmax(broken)),
        )


def single_step(vertices: FloatArray) -> float:
    """Return the step between neighbouring numbers of single precision as large as the largest coordinate."""
    with np.errstate(over="ignore", invalid="ignore"):
        return float(np.spacing(np.float32(max(vertices.max(initial=0.0), -vertices.min(initial=0.0)))))


def written_step(text: bytes, vertices: FloatArray) -> float:
    """Return the step that the decimals leave with which a text writes its largest coordinates.

    It is never more than that of single precision: round numbers with few decimals are meant.
    """
    least = 0.5 * float(np.abs(vertices).max(initial=0.0))
    found = [one for one in WRITTEN.finditer(text[:SAMPLE]) if abs(float(one[0])) >= least]
    return min([single_step(vertices), *(10.0 ** (int(one[2] or 0) - len(one[1])) for one in found)])


def resolves(step: float, vertices: FloatArray) -> bool:
    """Return whether steps are small enough for the extent of a mesh."""
    return step <= RESOLUTION_SHARE * float(np.ptp(vertices, axis=0).max(initial=0.0))


def ply_content(vertices: FloatArray, faces: IntArray, *, comment: bytes = b"", kinds: IntArray | None = None) -> bytes:
    """Return a binary little-endian PLY file with double coordinates; equal arrays, equal bytes.

    Args:
        vertices: (n, 3).
        faces: (m, 3).
        comment: a line for the header without its end, or nothing.
        kinds: (m,) a number for each face, or None.
    """
    fields: list[tuple[str, str] | tuple[str, str, int]] = [("count", "u1"), ("corners", "<i4", 3)]
    labelled = "" if kinds is None else f"property int {_KIND}\n"
    data = np.empty(len(faces), dtype=fields if kinds is None else [*fields, ("kind", "<i4")])
    data["count"], data["corners"] = 3, faces
    if kinds is not None:
        data["kind"] = kinds
    body = vertices.astype("<f8").tobytes() + data.tobytes()
    said = comment and comment.replace(b"{", f'{{"content": "{_digest(body)}", '.encode("ascii"), 1) + b"\n"
    header = (
        f"element vertex {len(vertices)}\nproperty double x\nproperty double y\nproperty double z\n"
        f"element face {len(faces)}\nproperty list uchar int vertex_indices\n{labelled}{_END}\n"
    )
    return b"ply\nformat binary_little_endian 1.0\n" + said + header.encode("ascii") + body


@lru_cache(maxsize=2)
def stored_mesh(file: MeshFile) -> bytes:
    """Return a mesh as it was read, as the PLY file from which it is read again with all that is known of it.

    A part and its body are the same in the bundles of all backends.
    """
    names, sets, kinds = _kinds(file.regions, faces=len(file.faces))
    origin = {
        "name": file.name, "sha256": file.digest, "unit": file.unit, "label": file.label,
        "notes": [list(note) for note in file.notes], "regions": names, "sets": sets,
    }  # fmt: skip
    # A name may hold the word that ends a header.
    text = json.dumps(origin).replace(_END, _END.replace("h", "\\u0068"))
    comment = ORIGIN + text.encode("ascii")
    return ply_content(file.vertices, file.faces, comment=comment, kinds=kinds if names else None)


def origin_of(header: bytes, body: bytes) -> tuple[bytes, dict[str, Any] | None]:
    """Return the header of a PLY file without the comment of a stored mesh, and what that says.

    Args:
        header: up to the word that ends it.
        body: behind that word.

    Returns:
        None for what it says where there is no such comment, or it does not belong to these vertices and faces.
    """
    start = header.find(b"\n" + ORIGIN) + 1
    if start == 0:
        return header, None
    end = header.find(b"\n", start)
    without = header[:start] + header[end + 1 :]
    try:
        said = json.loads(header[start + len(ORIGIN) : end])
        known = said["content"] == _digest(body.partition(b"\n")[2]) and _is_sound(said)
    except (ValueError, KeyError, TypeError, RecursionError):
        known, said = False, None
    return without, cast("dict[str, Any]", said) if known else None


def restored(mesh: MeshFile, origin: dict[str, Any], labels: IntArray | None) -> MeshFile:
    """Return a mesh with what `origin_of` says of the file it was read from; labels (m,) tell each face's regions."""
    kinds = np.zeros(len(mesh.faces), dtype=np.int64) if labels is None else labels
    members = {
        name: np.flatnonzero(np.isin(kinds, [kind for kind, of in enumerate(origin["sets"]) if number in of]))
        for number, name in enumerate(origin["regions"])
    }
    notes = cast("Notes", tuple(tuple(note) for note in origin["notes"]))
    return replace(
        mesh, name=origin["name"], digest=origin["sha256"], unit=origin["unit"], label=origin["label"], notes=notes,
        regions=members, step=0.0,
    )  # fmt: skip


def _is_sound(said: dict[str, Any]) -> bool:
    """Return whether a comment says what one of geoprint says."""
    name, notes, sets = said["name"], said["notes"], said["sets"]
    return (
        isinstance(name, str)
        and name.isprintable()
        and bool(name)
        and not {"/", "\\"} & set(name)
        and isinstance(said["sha256"], str)
        and len(bytes.fromhex(said["sha256"])) == hashlib.sha256().digest_size
        and said["unit"] in UNITS
        and (said["label"] is None or isinstance(said["label"], int))
        and all(isinstance(one, str) and isinstance(value, str | float | int) for one, value in notes)
        and all(isinstance(one, str) for one in said["regions"])
        and all(isinstance(number, int) for one in sets for number in one)
    )


def _kinds(regions: Regions, *, faces: int) -> tuple[list[str], list[list[int]], IntArray]:
    """Return the names of regions, the sets of them in which faces lie, by their numbers, and (m,) the set of each."""
    kinds = np.zeros(faces, dtype=np.int64)
    for members in regions.values():
        # What differs so far stays apart; faces of the region leave those beside them.
        marks = np.zeros(faces, dtype=np.int64)
        marks[members] = 1
        kinds = np.unique(2 * kinds + marks, return_inverse=True)[1].reshape(-1)
    sets: list[list[int]] = [[] for _ in range(int(kinds.max(initial=0)) + 1)]
    for number, members in enumerate(regions.values()):
        held: list[int] = np.unique(kinds[members]).tolist()
        for kind in held:
            sets[kind].append(number)
    return list(regions), sets, kinds


def _digest(body: bytes) -> str:
    return hashlib.sha256(body).hexdigest()
