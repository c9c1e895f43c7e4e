"""A thickness, layer upon layer: each is planned by itself, as a part that lies on the one below.

Layers do not wait for each other: what one lies on is a level of the distance from the part, not what was planned. So
two are planned at a time, each in a process of its own, and nothing is written before all of them are verified.

The processes are started afresh, alike on every platform: a script calls `plan_stack` under
`if __name__ == "__main__":`, and what it registered itself (a backend, a pattern) is known there only where a package's
entry point brings it.
"""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from importlib.metadata import version
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TypeAlias

from geoprint.account.records.rounding import as_json, read_record
from geoprint.account.records.stack import LeftOutRecord, StackedLayerRecord, StackRecord
from geoprint.account.stacked.page import stack_page
from geoprint.account.stacked.summary import finished_record, layer_record
from geoprint.config import Job
from geoprint.errors import FieldError, ResourceError, UsageError, VerificationError, naming
from geoprint.export import TIMINGS, check_writable, json_bytes, write_bundle
from geoprint.pipeline.bundles.contents import STACK
from geoprint.pipeline.planning import plan
from geoprint.pipeline.saving import save_plan
from geoprint.pipeline.stacked.simulating import finished_stack, stacked_layer
from geoprint.pipeline.workpiece import EMPTY, Stack, read_stack
from geoprint.results import StackedLayer
from geoprint.surfaces import face_areas

# The page beside stack.json.
REPORT = "report.html"
# Plans at a time: each takes up to a gigabyte.
WORKERS = 2
# What is said and kept of a layer, or why there is nothing to print in it.
_Found: TypeAlias = "tuple[StackedLayerRecord, StackedLayer] | LeftOutRecord"


def plan_stack(
    job: Job, directory: Path | str, *, overwrite: bool = False, observe: Callable[[str], None] = lambda _: None
) -> StackRecord:
    """Plan every layer of a thickness and write their bundles, stack.json and report.html: all verified, or nothing.

    Args:
        job: with a thickness, without a layer.
        directory: where the folder shall stand; layer 1 is in `layer-01`, and so on.
        overwrite: whether an existing result may be replaced.
        observe: called with what is being done.

    Returns:
        What stack.json says.

    Raises:
        UsageError: the job has no thickness or one layer alone, or the folder exists already.
        ExportError: nothing can be written there.
        ResourceError: a process was ended from outside, as it is where memory runs out.
        GeoprintError: as `plan`; the sentence names the layer.
    """
    if not job.layered or job.layer is not None:
        raise UsageError("a stack needs a thickness or a target and no layer: `plan` plans one of them.")
    check_writable(directory, overwrite=overwrite)
    stack = read_stack(job)
    with TemporaryDirectory() as staging:
        found = _planned(job, [Path(staging, folder) for folder in _folders(stack.count)], observe)
        observe("finished thickness")
        told, page = _finished(job, stack, found)
        written = [path for path in sorted(Path(staging).rglob("*")) if path.is_file()]
        files = {path.relative_to(staging).as_posix(): path.read_bytes() for path in written}
    timings = {name: content for name, content in files.items() if name.endswith(f"/{TIMINGS}")}
    listed = {name: content for name, content in files.items() if name not in timings}

    def verify(folder: Path) -> None:
        if read_record(folder / STACK, StackRecord) != told:
            raise VerificationError(f"{STACK} does not read back as it was told; the disk may be faulty: write again.")

    own = {STACK: json_bytes(as_json(told)), REPORT: page}
    write_bundle(directory, own | listed, overwrite=overwrite, verify=verify, unlisted=timings)
    return told


def _finished(job: Job, stack: Stack, found: Sequence[_Found]) -> tuple[StackRecord, bytes]:
    """Return what stack.json says when all layers are planned, and report.html."""
    printed = [layer for layer in found if not isinstance(layer, LeftOutRecord)]
    finished = finished_stack(job, stack, [layer for _, layer in printed])
    layers = tuple(record for record, _ in printed)
    told = StackRecord(
        schema=1,
        version=version("geoprint"),
        part=job.surface.name,
        thickness_mm=stack.thickness,
        target=None if job.target is None else job.target.name,
        target_mm3=None if stack.target is None else stack.target.volume,
        finished=finished_record(finished, wanted=_wanted(stack, layers)),
        layers=layers,
        left_out=tuple(layer for layer in found if isinstance(layer, LeftOutRecord)),
    )
    return told, stack_page(finished, told, job)


def _wanted(stack: Stack, layers: Sequence[StackedLayerRecord]) -> float:
    """Return the volume that a stack shall have [mm3]: that of its target where a formula has it."""
    volume = None if stack.target is None else stack.target.volume
    return sum(layer.wanted_mm3 for layer in layers) if volume is None else volume


def _folders(count: int) -> list[str]:
    """Return the folder of each layer."""
    return [f"layer-{number:02}" for number in range(1, count + 1)]


def _planned(job: Job, folders: list[Path], observe: Callable[[str], None]) -> list[_Found]:
    """Plan the layers, two at a time, and return what is said and kept of each; the first refusal ends it.

    Raises:
        FieldError: a layer over one with nothing to print in it has something, or none has.
    """
    observe(f"{len(folders)} layers")
    with ProcessPoolExecutor(WORKERS, mp_context=multiprocessing.get_context("spawn")) as pool:
        waiting = {pool.submit(_layer, job, number, folder): number for number, folder in enumerate(folders, start=1)}
        try:
            for done, future in enumerate(as_completed(waiting), start=1):
                future.result()
                observe(f"{len(folders)} layers, {done} done")
        except BrokenProcessPool as error:
            raise ResourceError(
                "a process that planned a layer was ended from outside, most likely for want of memory: each takes "
                "about a gigabyte. Plan layer by layer with `--layer`, or choose a larger spacing. (A script calls "
                'this under `if __name__ == "__main__":`.)'
            ) from error
        except BaseException:
            pool.shutdown(wait=True, cancel_futures=True)
            raise
        found = [future.result() for future, _ in sorted(waiting.items(), key=lambda each: each[1])]
    printed = [not isinstance(layer, LeftOutRecord) for layer in found]
    holes = [layer for layer, above in zip(found, printed[1:], strict=False) if above]
    empty = next((layer for layer in (*holes, found[0]) if isinstance(layer, LeftOutRecord)), None)
    if empty is not None:
        raise FieldError(empty.reason)
    return found


def _layer(job: Job, number: int, folder: Path) -> _Found:
    """Plan one layer and write its bundle, or say why there is nothing to print in it."""
    try:
        with naming(f"layer {number}"):
            planned = plan(job.model_copy(update={"layer": number}))
            told = save_plan(planned, folder)
    except FieldError as error:
        if not error.details.get(EMPTY):
            raise
        return LeftOutRecord(number=number, reason=str(error))
    kept = stacked_layer(planned)
    return layer_record(told, kept, folder=folder.name, area=float(face_areas(planned.workpiece.part).sum())), kept
