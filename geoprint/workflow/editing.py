"""Planning a job again and again while it is edited: what an edit does not change is kept."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Generic, TypeVar, final

import numpy as np

from geoprint.config import Job
from geoprint.distance import Piecewise
from geoprint.errors import UsageError
from geoprint.metrics import MeasuredSurface
from geoprint.model import Cell, Surface
from geoprint.results import Plan, Workpiece
from geoprint.workflow.backend_choice import backend_of, check_options, check_part, seeks_middle
from geoprint.workflow.covering import (
    PLAIN,
    DrawnRuns,
    Measured,
    distance_errors_of,
    drawn_runs,
    measured_covers,
    measured_surface,
    taken_alike,
)
from geoprint.workflow.planning import plan_measured
from geoprint.workflow.stages import Stages
from geoprint.workflow.workpiece import (
    SidedPart,
    read_cell_and_part,
    reading_keys,
    refined_part,
    require_placement,
    with_rounds,
    workpiece_of,
)

_Value = TypeVar("_Value")


@final
class Planner:
    """Plans a job while it is edited, with the results of `geoprint.plan`.

    It keeps what the stages made last, and makes anew what an edit is an input of:

    - cell and part, as read and repaired: while the `reading_keys` of `geoprint.workflow.workpiece` stay;
    - the refined surface: while spacing and backend stay, or another refinement comes to the same triangles;
    - of each backend what it precomputes on that surface, such as matrices or a UV map: while its options stay;
    - what evenness is measured on, without paths: while spacing and part stay;
    - the workpiece, and the evenness of its paths: while no key differs.

    Files are read once, unless the job names others. A job of rounds has another spacing, and so another surface, with
    each source: give a spacing for fast edits.

    Args:
        job: the first one; its workpiece and its backend are made ready.
        observe: called with the name of each stage as it starts.

    Raises:
        GeoprintError: as `geoprint.plan`. A method that raises leaves what was kept as it was.

    Examples:
        >>> import geoprint
        >>> job = geoprint.job_of(surface="data/plate.ply", unit="mm", spacing=2.0, robot=False)
        >>> planner = Planner(job)
        >>> for x in (-10.0, 0.0):
        ...     edited = geoprint.job_of(**dict(job) | {"source": {"point": [x, 0.0, 0.0]}})
        ...     print(len(planner.paths(edited).paths))
        21
        21
    """

    def __init__(self, job: Job, *, observe: Callable[[str], None] = lambda _: None) -> None:
        self._observe = observe
        self._parts = _Latest[tuple[Cell, SidedPart]]()
        self._refined = _Latest[tuple[Surface, float]]()
        self._surfaces: list[Surface] = []
        self._backends: dict[str, _Latest[Piecewise]] = {}
        self._workpieces = _Latest[Workpiece]()
        self._measuring = _Latest[MeasuredSurface]()
        self._covers = _Latest[tuple[Measured, ...]]()
        self._backend(job, self._workpiece(job, Stages(observe)))

    def paths(self, job: Job) -> DrawnRuns:
        """Return the runs of a job in printing order, as its plan has them.

        Where the job leaves the medial axis to the better treatment, it is plain here: which is better, only `figures`
        tells.

        Raises:
            GeoprintError: as `geoprint.plan` without a robot.
        """
        stage = Stages(self._observe)
        workpiece = self._workpiece(job, stage)
        job = with_rounds(job, workpiece.cell)
        if seeks_middle(job):
            job = job.model_copy(update={"middle": PLAIN})
        return drawn_runs(job, workpiece, stage, backend=self._backend(job, workpiece))

    def figures(self, job: Job) -> Plan:
        """Return the paths of a job with their evenness: thickness, coverage and spacing, as its plan has them.

        Flow, robot and the errors of the distance are left out.

        Raises:
            GeoprintError: as `geoprint.plan` without a robot.
        """
        stage = Stages(self._observe)
        covers = self._measured(job, self._workpiece(job, stage), stage)
        return taken_alike([covers])[0][0]

    def plan(self, job: Job) -> Plan:
        """Return the plan of a job.

        Raises:
            GeoprintError: as `geoprint.plan`.
        """
        stage = Stages(self._observe)
        workpiece = self._workpiece(job, stage)

        def measured() -> tuple[Measured, ...]:
            covers = self._measured(job, workpiece, stage)
            with stage("evenness"):
                on = self._measured_on(workpiece, spacing=covers[0][0].contours.spacing)
                distance = distance_errors_of(covers[0][0], on)
            return tuple((replace(paths, distance=distance), found) for paths, found in covers)

        return plan_measured(measured, workpiece, stage)

    def _workpiece(self, job: Job, stage: Stages) -> Workpiece:
        """Return the workpiece of a job, after the checks of `geoprint.plan`."""
        check_part(job)
        check_options(job, [job.backend])
        if job.compared:
            raise UsageError("a job that is edited has one backend: omit `compared`.")
        cell, sided = self._parts((reading_keys(job),), lambda: read_cell_and_part(job, stage))
        require_placement(job, cell)

        def refined(sided: SidedPart, backends: Sequence[str], /, *, spacing: float) -> tuple[Surface, float]:
            return self._refined((sided, *backends, spacing), lambda: self._kept(sided, backends, spacing=spacing))

        return self._workpieces(
            (job, sided),
            lambda: workpiece_of(job, stage, cell=cell, sided=sided, backends=[job.backend], refined=refined),
        )

    def _kept(self, sided: SidedPart, backends: Sequence[str], *, spacing: float) -> tuple[Surface, float]:
        """Return what `refined_part` does, with the surface that was kept where it has the same triangles."""
        surface, edge_length = refined_part(sided, backends, spacing=spacing)
        if not any(_same(surface, kept) for kept in self._surfaces):
            self._surfaces, self._backends = [surface], {}
        return self._surfaces[0], edge_length

    def _backend(self, job: Job, workpiece: Workpiece) -> Piecewise:
        """Return the backend of a job on the surface of its workpiece."""
        build, surface = backend_of(job), workpiece.surface
        latest = self._backends.setdefault(job.backend, _Latest())
        return latest((surface, build.func, build.keywords), lambda: Piecewise(surface, build))

    def _measured(self, job: Job, workpiece: Workpiece, stage: Stages) -> tuple[Measured, ...]:
        """Return what `measured_covers` does, without the errors of the distance."""
        whole = with_rounds(job, workpiece.cell)
        backend = self._backend(job, workpiece)
        on = None if job.spacing is None else self._measured_on(workpiece, spacing=job.spacing)
        return self._covers(
            (job, workpiece),
            lambda: measured_covers(whole, workpiece, stage, on=on, backend=backend, distance=False),
        )

    def _measured_on(self, workpiece: Workpiece, *, spacing: float) -> MeasuredSurface:
        """Return the part as its paths are measured."""
        part, widths = workpiece.part, workpiece.widths
        return self._measuring((part, widths, spacing), lambda: measured_surface(workpiece, spacing=spacing))


def _same(surface: Surface, other: Surface) -> bool:
    """Return whether two surfaces have the same name and triangles."""
    same = np.array_equal(surface.vertices, other.vertices) and np.array_equal(surface.faces, other.faces)
    return surface.name == other.name and same


@final
class _Latest(Generic[_Value]):
    """The value that was made last; anew only of other inputs."""

    def __init__(self) -> None:
        self._made: list[tuple[tuple[object, ...], _Value]] = []

    def __call__(self, inputs: tuple[object, ...], make: Callable[[], _Value]) -> _Value:
        """Return the value of some inputs; arrays and surfaces among them are the same ones or others."""
        if not self._made or self._made[0][0] != inputs:
            self._made = [(inputs, make())]
        return self._made[0][1]
