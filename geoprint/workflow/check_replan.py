"""`geoprint check --full`: a bundle planned again from its own job and inputs, and compared with what comes out.

The same geoprint plans the same bytes again on the same kind of machine; elsewhere the last digits may differ, so that
numbers are compared, too. What is found here is what a plan chooses: speeds, leans, paths, and all figures of them.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path, PurePosixPath

import numpy as np

from geoprint.errors import GeoprintError
from geoprint.geometry.files import load
from geoprint.model import Surface
from geoprint.postprocessor import Json
from geoprint.postprocessor.interface import CONTROLLER_FOLDER
from geoprint.postprocessor.registry import as_written, post_processor_names
from geoprint.reporting.check import Finding
from geoprint.reporting.plan import record_plan
from geoprint.results import Plan
from geoprint.workflow.check_inputs import differences, planned_job
from geoprint.workflow.planning import plan
from geoprint.workflow.replan import JOB
from geoprint.workflow.saving import plan_files

# Figures that are planned again on another machine agree to this, and this share of them.
NEAR, NEAR_SHARE = 1e-3, 1e-3
# Numbers in tables and meshes likewise [mm, s, rad].
TABLE_NEAR = 1e-3
# So many figures of a record that differ are listed.
LISTED = 10
# The surface that was planned on.
SURFACE = "surface.ply"


def replanned(
    folder: Path,
    names: Mapping[str, str],
    *,
    keep: Callable[[Plan], object] = lambda _: None,
    observe: Callable[[str], None] = lambda _: None,
) -> Iterator[Finding]:
    """Yield the files of a bundle that come out otherwise when it is planned again.

    Args:
        folder: the bundle, every file of which may be opened.
        names: of its files.
        keep: called with the plan.
        observe: called with the name of each stage as it starts.
    """
    try:
        planned = plan(planned_job(folder, names), observe=lambda name: observe(f"planned again: {name}"))
        record = record_plan(planned)
    except GeoprintError as error:
        yield Finding(JOB, 1, f"planned again: {error}")
        return
    keep(planned)
    files = plan_files(planned, record, charts={})
    for name, content in files.items():
        path = folder / name
        if path.is_file() and (written := _written(folder, name)) != content:
            if name == SURFACE:
                yield from _mesh_findings(load(path, unit="mm"), planned.workpiece.surface)
            else:
                yield from _differing(name, written, content)
    yield from (Finding(name, 1, "planned again there is such a file") for name in files if name not in names)
    known = {*post_processor_names()}
    programs = [name for name in names if known & {*PurePosixPath(name).parts[:-1]} and name not in files]
    yield from (Finding(name, 1, "planned again there is no such file") for name in programs)


def _written(folder: Path, name: str) -> bytes:
    """Return a file of a bundle, its settings as they were written."""
    content = (folder / name).read_bytes()
    return as_written(_dialect_of(name), PurePosixPath(name).name, content)


def _dialect_of(name: str) -> str:
    """Return the post-processor that wrote a file of a program; empty for another file."""
    parts, known = PurePosixPath(name).parts[:-1], post_processor_names()
    return next((part for part in parts if part in known), "")


def _differing(name: str, written: bytes, content: bytes) -> Iterator[Finding]:
    """Yield where a file is another than the one that was planned again, beyond its last digits."""
    suffix = PurePosixPath(name).suffix
    if suffix == ".json":
        yield from record_findings(name, json.loads(written), json.loads(content))
    elif suffix == ".csv":
        yield from _table_findings(name, written, content)
    elif not _dialect_of(name) or CONTROLLER_FOLDER in PurePosixPath(name).parts:
        # The program is held against the tables, whose last digits it follows.
        yield Finding(name, 1, "planned again it comes out otherwise")


def record_findings(name: str, said: Json, now: Json) -> Iterator[Finding]:
    """Yield the figures of a record that differ from those that were found again."""
    found = differences(said, now, near=NEAR, share=NEAR_SHARE)
    for _, (key, before, after) in zip(range(LISTED), found, strict=False):
        yield Finding(name, 1, f"{key} is {before}, planned again it is {after}")


def _table_findings(name: str, written: bytes, content: bytes) -> Iterator[Finding]:
    one, other = (text.decode("latin-1").split("\n") for text in (written, content))
    if len(one) != len(other):
        yield Finding(name, 1, f"it has {len(one) - 2} rows, planned again {len(other) - 2}")
        return
    for row, (line, its) in enumerate(zip(one, other, strict=True), start=1):
        if line != its and not _near(line, its):
            yield Finding(name, row, f"it says {line[:60]!r}..., planned again {its[:60]!r}...")
            return


def _near(line: str, its: str) -> bool:
    try:
        pairs = [(float(one), float(other)) for one, other in zip(line.split(","), its.split(","), strict=True)]
    except ValueError:
        return False
    return all(abs(one - other) <= TABLE_NEAR for one, other in pairs)


def _mesh_findings(found: Surface, again: Surface) -> Iterator[Finding]:
    """Yield that surface.ply is another surface, by its places and triangles."""
    if found.faces.shape != again.faces.shape or (found.faces != again.faces).any():
        yield Finding(SURFACE, 1, "its triangles are others than when it is planned again")
    elif np.abs(found.vertices - again.vertices).max(initial=0.0) > TABLE_NEAR:
        yield Finding(SURFACE, 1, "its places are others than when it is planned again")
