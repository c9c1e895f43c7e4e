"""The same part planned with several backends: what became of each, and of a part that could not be compared."""

from __future__ import annotations

from typing import final

from geoprint.config import Job
from geoprint.errors import FieldError
from geoprint.model import comparable, frozen
from geoprint.quality import Uniformity
from geoprint.results.plan import Plan
from geoprint.results.workpiece import Workpiece

# The stages whose time is a backend's own.
PLANNING_STAGES = ("contours", "path")


@final
@frozen
class Planned:
    """A backend's outcome.

    Attributes:
        plan: with the robot where the part is printable, without it where it is not.
        not_printable: why the robot cannot print it, or None where it can or was left out.
        lost: reason and share of the deposited length that the arm cannot reach for it, largest first; empty where
            reach is not what refuses.
    """

    plan: Plan
    not_printable: str | None
    lost: tuple[tuple[str, float], ...] = ()

    @property
    def uniformity(self) -> Uniformity:
        """How even its paths are.

        Raises:
            FieldError: the plan holds strokes and poses alone, which nobody has measured.
        """
        if self.plan.uniformity is None:
            raise FieldError("how even these paths are was not measured: compare what `plan` or `compare` returned.")
        return self.plan.uniformity

    @property
    def planning_time(self) -> float:
        """Seconds that the backend's own stages took."""
        return sum(seconds for name, seconds in self.plan.timings if name in PLANNING_STAGES)


@final
@comparable
class Refused:
    """A backend that cannot plan on this part.

    Attributes:
        reason: one sentence.
    """

    reason: str


@final
@frozen
class Comparison:
    """Several backends on one workpiece.

    Attributes:
        job: what was asked for; its backend does not count.
        workpiece: what all of them planned on.
        outcomes: backend name to outcome, in the order of the table.
    """

    job: Job
    workpiece: Workpiece
    outcomes: tuple[tuple[str, Planned | Refused], ...]

    @property
    def planned(self) -> tuple[tuple[str, Planned], ...]:
        """Those that planned, by name."""
        return tuple((name, outcome) for name, outcome in self.outcomes if isinstance(outcome, Planned))

    @property
    def refused(self) -> tuple[tuple[str, str], ...]:
        """Name and reason of those that did not."""
        return tuple((name, outcome.reason) for name, outcome in self.outcomes if isinstance(outcome, Refused))


@final
@frozen
class FailedPart:
    """A part that could not be compared at all.

    Attributes:
        job: what was asked for.
        reason: one sentence.
    """

    job: Job
    reason: str
