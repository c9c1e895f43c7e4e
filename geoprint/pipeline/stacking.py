"""A thickness, layer upon layer: each is planned by itself, as a part that lies on the one below.

Layers do not wait for each other: what one lies on is a level of the distance from the part, not what was planned. So
two are planned at a time, each in a process of its own, and nothing is written before all of them are verified.

The processes are started afresh, alike on every platform: a script calls `plan_stack` under
`if __name__ == "__main__":`, and what it registered itself (a backend, a pattern) is known there only where a package's
entry point brings it.
"""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from importlib.metadata import version
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from geoprint.account.prints.cure import with_cure
from geoprint.account.records.rounding import as_json, read_record
from geoprint.account.records.stack import LeftOutRecord, StackedLayerRecord, StackRecord
from geoprint.config import Job, load_cell
from geoprint.errors import FieldError, ResourceError, UsageError, VerificationError, naming
from geoprint.export import TIMINGS, check_writable, json_bytes, write_bundle
from geoprint.pipeline.bundles.contents import STACK
from geoprint.pipeline.choice import check_options
from geoprint.pipeline.planning import plan
from geoprint.pipeline.saving import save_plan
from geoprint.pipeline.workpiece import EMPTY, read_stack
from geoprint.results import Plan
from geoprint.surfaces import face_areas

# Plans at a time: each takes up to a gigabyte.
WORKERS = 2


def plan_stack(
    job: Job, directory: Path | str, *, overwrite: bool = False, observe: Callable[[str], None] = lambda _: None
) -> StackRecord:
    """Plan every layer of a thickness and write their bundles and stack.json: all of them verified, or nothing.

    Args:
        job: with a thickness, without a layer.
        directory: where the folder shall stand; layer 1 is in `layer-01`, and so on.
        overwrite: whether an existing result may be replaced.
        observe: called with what is being done.

    Returns:
        What stack.json says.

    Raises:
        UsageError: the job has no thickness or one layer alone, the folder exists already, or as `check_options`.
        ExportError: nothing can be written there.
        ResourceError: a process was ended from outside, as it is where memory runs out.
        GeoprintError: as `plan`; the sentence names the layer.
    """
    if not job.layered or job.layer is not None:
        raise UsageError("a stack needs a thickness or a target and no layer: `plan` plans one of them.")
    check_options(job, [job.backend])
    check_writable(directory, overwrite=overwrite)
    stack = read_stack(job)
    with TemporaryDirectory() as staging:
        found = _planned(job, [Path(staging, folder) for folder in _folders(stack.count)], observe)
        untold = StackRecord(
            schema=1,
            version=version("geoprint"),
            part=job.surface.name,
            thickness_mm=stack.thickness,
            target=None if job.target is None else job.target.name,
            target_mm3=None if stack.target is None else stack.target.volume,
            layers=tuple(layer for layer in found if isinstance(layer, StackedLayerRecord)),
            left_out=tuple(layer for layer in found if isinstance(layer, LeftOutRecord)),
        )
        told = with_cure(untold, load_cell(job.cell))
        written = [path for path in sorted(Path(staging).rglob("*")) if path.is_file()]
        files = {path.relative_to(staging).as_posix(): path.read_bytes() for path in written}
    timings = {name: content for name, content in files.items() if name.endswith(f"/{TIMINGS}")}
    listed = {name: content for name, content in files.items() if name not in timings}

    def verify(folder: Path) -> None:
        if read_record(folder / STACK, StackRecord) != told:
            raise VerificationError(f"{STACK} does not read back as it was told; the disk may be faulty: write again.")

    stack = {STACK: json_bytes(as_json(told))}
    write_bundle(directory, stack | listed, overwrite=overwrite, verify=verify, unlisted=timings)
    return told


def _folders(count: int) -> list[str]:
    """Return the folder of each layer."""
    return [f"layer-{number:02}" for number in range(1, count + 1)]


def _planned(job: Job, folders: list[Path], observe: Callable[[str], None]) -> list[StackedLayerRecord | LeftOutRecord]:
    """Plan the layers, two at a time, and return what is said of each; the first refusal ends it.

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
    printed = [isinstance(layer, StackedLayerRecord) for layer in found]
    holes = [layer for layer, above in zip(found, printed[1:], strict=False) if above]
    empty = next((layer for layer in (*holes, found[0]) if isinstance(layer, LeftOutRecord)), None)
    if empty is not None:
        raise FieldError(empty.reason)
    return found


def _layer(job: Job, number: int, folder: Path) -> StackedLayerRecord | LeftOutRecord:
    """Plan one layer and write its bundle, or say why there is nothing to print in it."""
    try:
        with naming(f"layer {number}"):
            planned = plan(job.model_copy(update={"layer": number}))
            told = save_plan(planned, folder)
    except FieldError as error:
        if not error.details.get(EMPTY):
            raise
        return LeftOutRecord(number=number, reason=str(error))
    (layer,) = told.layers
    area = float(face_areas(planned.workpiece.part).sum())
    spacing = None if told.uniformity is None else told.uniformity.spacing
    robots, light = told.robot, None if told.deposition is None else told.deposition.light
    return StackedLayerRecord(
        folder=folder.name,
        bottom_mm=layer.bottom_mm,
        height_mm=layer.height_mm,
        area_mm2=area,
        pattern=str(planned.job.drawing),
        runs=told.paths.runs,
        deposit_mm=told.paths.deposit_mm,
        spacing_cv=None if spacing is None else spacing.cv,
        gap=None if told.uniformity is None else told.uniformity.gap,
        laid_mm3=_laid(planned),
        wanted_mm3=area * layer.height_mm,
        print_s=sum(robot.motion.duration_s for robot in robots) if robots else None,
        clearance_mm=min((robot.clearance.smallest_mm for robot in robots), default=None),
        dose_mj_cm2=None if light is None else light.all_passes,
        warnings=told.warnings,
        not_checked=tuple(dict.fromkeys(text for robot in robots for text in robot.clearance.not_checked)),
    )


def _laid(planned: Plan) -> float:
    """Return the volume that the poses of a plan lay [mm3]: flow times the length of the run on the layer's surface."""
    poses = planned.poses
    lengths = np.linalg.norm(np.diff(poses.surface_points, axis=0), axis=1)
    return float((lengths * poses.flow[:-1])[poses.laid].sum())
