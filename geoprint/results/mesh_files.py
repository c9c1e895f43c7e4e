"""What was made of a mesh file: its examination, or a part with another mesh."""

from __future__ import annotations

from typing import final

from geoprint.model import Reading, Surface, frozen
from geoprint.surfaces import Landmark
from geoprint.surfaces.files import LabelFound
from geoprint.surfaces.remesh import Deviation
from geoprint.surfaces.repair import Inspection, PreparationReport


@final
@frozen
class FileInspection:
    """What the mesh doctor says of a file.

    Attributes:
        name: of the file.
        unit: that it was read in.
        assumed: whether the unit is a guess from the size, because neither file nor user said it.
        hint: where the size is unusual, what that may mean.
        low: (3,) lowest, and
        high: (3,) highest coordinates [mm].
        found: the examination of the mesh.
        regions: name, number of faces and area [mm2] of each that the file has.
        side: what tells which side of it is outside, in words.
        terraces: height of the steps where the surface is a staircase around voxels [mm], else None.
        backends: by name, 'yes', or why a backend cannot plan on it, or that it was 'not tried' and why.
        reading: what was used of the file, skipped and assumed.
        labels: that a label volume holds; empty for other files.
        landmarks: places to find the way by; none where preparing refuses the mesh.
        label: of which the surface is, or None.
    """

    name: str
    unit: str
    assumed: bool
    hint: str | None
    low: tuple[float, ...]
    high: tuple[float, ...]
    found: Inspection
    regions: tuple[tuple[str, int, float], ...]
    side: str
    terraces: float | None
    backends: tuple[tuple[str, str], ...]
    reading: Reading = Reading()
    labels: tuple[LabelFound, ...] = ()
    landmarks: tuple[Landmark, ...] = ()
    label: int | None = None


@final
@frozen
class VolumeInspection:
    """What is said of a label volume where no label is chosen of several, or no surface can be put around one.

    Attributes:
        name: of the file.
        labels: that it holds.
        refusal: why there is no surface around the label that was chosen or is the only one; None where none was.
        reading: what was used of the file, skipped and assumed.
    """

    name: str
    labels: tuple[LabelFound, ...]
    refusal: str | None
    reading: Reading


@final
@frozen
class Remeshed:
    """A part with another mesh.

    Attributes:
        before: the part as prepared.
        preparation: what preparing changed.
        after: the part with its new mesh.
        steps: what was done, in words.
        deviation: how far the two lie apart.
        allowed: how far they may [mm].
    """

    before: Surface
    preparation: PreparationReport
    after: Surface
    steps: tuple[str, ...]
    deviation: Deviation
    allowed: float
