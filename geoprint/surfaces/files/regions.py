"""Named regions of a mesh: the groups, objects, solids and labels that its file gives to faces."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from typing import TypeAlias

import numpy as np

from geoprint.errors import UsageError
from geoprint.model import IntArray

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
            "labels of PLY are read; choose the patch by `--at`, `--box` or `--curve`."
        )
    listed = ", ".join(f"'{each[:LONGEST_NAME]}'" for each in list(regions)[:MOST_NAMED])
    more = f" and {len(regions) - MOST_NAMED} more" if len(regions) > MOST_NAMED else ""
    raise UsageError(f"{file} has no region '{name[:LONGEST_NAME]}'; it has {listed}{more}.")


def printable(name: str) -> str:
    """Return a name in one line whose signs can all be printed."""
    line = " ".join(name.split())
    return "".join(sign if sign.isprintable() else "\N{REPLACEMENT CHARACTER}" for sign in line)
