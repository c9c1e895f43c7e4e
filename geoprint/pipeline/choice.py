"""Which backend a job names, and the options that it gives it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

from geoprint.backends import Backend, BackendFactory, backend, with_option
from geoprint.config import Job
from geoprint.errors import UsageError
from geoprint.model import Surface
from geoprint.registry import Entry, OptionValue

# The option that `--resolution` stands for, of whichever backend has it.
RESOLUTION = "resolution"


def check_options(job: Job, backends: Sequence[str]) -> None:
    """Check the options of a job, before the long work; those of a backend that is not chosen just have to be right.

    Raises:
        UsageError: a backend or one of its options is unknown, an option is missing or of another type, or the
            resolution means none of the backends.
    """
    chosen = [backend(name) for name in backends]
    if job.resolution is not None and not any(RESOLUTION in entry.options for entry in chosen):
        rastered = with_option(RESOLUTION)
        raise UsageError(
            f"`--resolution {job.resolution}` sets the raster of {', '.join(rastered)}, but {', '.join(backends)} has "
            f"none: leave it out, or choose the backend {rastered[0]}."
        )
    for entry in [*chosen, *(backend(name) for name in job.options if name not in backends)]:
        _options(job, entry)


def backend_of(job: Job) -> Callable[[Surface], Backend]:
    """Return what builds the backend of a job on a surface, with the options of the job.

    Raises:
        UsageError: as `check_options`.
    """
    entry = backend(job.backend)
    return partial(entry.factory, **_options(job, entry))


def with_backend(job: Job, name: str) -> Job:
    """Return the same job for another backend; without the resolution where that has no raster."""
    resolution = job.resolution if RESOLUTION in backend(name).options else None
    return job.model_copy(update={"backend": name, "resolution": resolution})


def _options(job: Job, entry: Entry[BackendFactory]) -> dict[str, OptionValue]:
    given = job.options.get(entry.name, {})
    if job.resolution is not None and RESOLUTION in entry.options:
        if RESOLUTION in given:
            raise UsageError(
                f"the resolution of {entry.name} is given twice, as `--resolution {job.resolution}` and as its option "
                f"{given[RESOLUTION]}: leave one of them out."
            )
        given = given | {RESOLUTION: job.resolution}
    return entry.checked(given)
