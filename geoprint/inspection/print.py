"""What appraising photographs of a print yields."""

from __future__ import annotations

from typing import final

from geoprint.inspection.beads import BeadLine, Shade
from geoprint.inspection.camera import Camera
from geoprint.inspection.held import Held
from geoprint.inspection.on_part import SetDistances
from geoprint.inspection.photograph import Photograph
from geoprint.model import frozen
from geoprint.process.feedback import PrintedProgram


@final
@frozen
class OnPlan:
    """A photograph held against a plan.

    Attributes:
        camera: that took it.
        held: how they lie beside the plan.
    """

    camera: Camera
    held: Held


@final
@frozen
class AppraisedPhotograph:
    """One photograph, appraised.

    Attributes:
        photograph: as it was read.
        width: of the beads that were looked for [pixels].
        threshold: of their contrast, over the spread of the grey values around them.
        beads: that were found, the longest first.
        on_plan: how they lie beside the plan; None where none was given.
    """

    photograph: Photograph
    width: float
    threshold: float
    beads: tuple[BeadLine, ...]
    on_plan: OnPlan | None


@final
@frozen
class Appraisal:
    """Photographs of prints, appraised side by side.

    Attributes:
        shade: what beads are, beside what they lie on.
        width_chosen: whether the width of the beads was chosen, not given.
        threshold_chosen: whether the threshold was chosen, not given.
        photographs: in the order given.
        pairs: of each two photographs, by their numbers from 0, the first lower: how far their beads lie apart
            [pixels].
        plan: name of the bundle, or None.
        printed_with: names and values of the plan and its cell; none without a plan.
        part: name of the part's file, or None.
        printed: the program of the print, where one photograph was held against its plan; else None.
    """

    shade: Shade
    width_chosen: bool
    threshold_chosen: bool
    photographs: tuple[AppraisedPhotograph, ...]
    pairs: tuple[tuple[int, int, SetDistances], ...]
    plan: str | None = None
    printed_with: tuple[tuple[str, str], ...] = ()
    part: str | None = None
    printed: PrintedProgram | None = None
