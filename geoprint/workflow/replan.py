"""What a bundle carries to be planned again: the job, and part, body, target, field, feedback and cell as read."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Mapping
from pathlib import Path, PurePosixPath
from typing import final

from geoprint.config import Job, job_of, job_text
from geoprint.errors import InputError, VerificationError, reason_of
from geoprint.geometry.files import stored_mesh
from geoprint.model import Surface, frozen
from geoprint.postprocessor import PLAN
from geoprint.results import Plan, Workpiece
from geoprint.workflow.bundles import REPORT, changes, listed_bundle
from geoprint.workflow.calibrating import edited

JOB, PART, BODY = "job.toml", "part.ply", "body.ply"
# What layers fill, as a mesh, or in a folder as the table that it is.
TARGET, TARGET_FOLDER = "target.ply", "target"
# Which lines fibres follow, and where the files lie that this names.
FIELD, FIELD_FOLDER = "field.toml", "field"
# What the last print taught.
FEEDBACK = "feedback.json"
# Where the cell's file stands, if the job names one, and an arm of one's own beside it.
CELL_FOLDER = "cell"


def input_files(plan: Plan) -> dict[str, bytes]:
    """Return name and content of the files from which a plan can be made again, whatever becomes of those it was of.

    Meshes are those that were read, before repair and refinement, so that planning takes the same road once more.
    """
    workpiece = plan.workpiece
    meshes = dict(zip((PART, BODY), workpiece.files, strict=False))
    cell = _cell_files(workpiece)
    target = _target_files(workpiece)
    field = _field_files(workpiece)
    fed = {} if workpiece.feedback_text is None else {FEEDBACK: workpiece.feedback_text.encode("utf-8")}
    job = plan.job.model_copy(
        update={
            "surface": Path(PART),
            "body": Path(BODY) if BODY in meshes else None,
            "target": next(map(Path, target), None),
            "field": Path(FIELD) if field else None,
            "feedback": next(map(Path, fed), None),
            "cell": Path(CELL_FOLDER, workpiece.cell.name) if cell else None,
        }
    )
    stored = {name: stored_mesh(file) for name, file in meshes.items()}
    return {JOB: job_text(job).encode("utf-8"), **stored, **target, **field, **fed, **cell}


@final
@frozen
class WrittenBundle:
    """A bundle as it stood when it was looked at.

    Attributes:
        folder: where it stands.
        version: of the geoprint that wrote it.
        hashes: of its files, by their names, as its manifest lists them.
    """

    folder: Path
    version: str
    hashes: Mapping[str, str]

    def differing(self, folder: Path) -> list[str]:
        """Return the files of another bundle that are not in this one with the same bytes, by what manifests say.

        Its report does not count: that says when it was made.
        """
        listed = listed_bundle(folder).items()
        return [name for name, digest in listed if name != REPORT and self.hashes.get(name) != digest]


def written_bundle(folder: Path | str) -> WrittenBundle:
    """Return what is said of a bundle before it is planned again.

    Raises:
        InputError: the folder is no bundle.
        VerificationError: its plan.json cannot be read.
    """
    folder = Path(folder)
    hashes = listed_bundle(folder)
    return WrittenBundle(folder, _version(folder), hashes)


def job_from(folder: Path | str, **changes: object) -> Job:
    """Return the job that a bundle was planned from; `plan` reproduces the bundle from it.

    Args:
        folder: a bundle that `geoprint plan` or `compare` wrote.
        **changes: keys of `Job`, as in `job_of`, that replace those of the bundle.

    Returns:
        The job, with files of the bundle in place of the original ones.

    Raises:
        InputError: the folder is no bundle, or an older geoprint wrote it.
        VerificationError: its job, part, body or cell was changed; the sentence names the file.
        UsageError: a change is unknown or meaningless.
    """
    return job_of(surface=job_file_of(folder), **changes)


def job_file_of(folder: Path | str) -> Path:
    """Return the job file of a bundle, after checking that all that it needs is as it was written.

    Raises:
        InputError: as `job_from`.
        VerificationError: as `job_from`.
    """
    folder = Path(folder)
    names = listed_bundle(folder)
    if JOB not in names:
        raise InputError(
            f"{folder} was written by geoprint {_version(folder)}, which did not keep the job: plan from the original "
            "files."
        )
    needed = {name: digest for name, digest in names.items() if is_input(name)}
    for name, reason in changes(folder, needed):
        if is_input(name):
            raise VerificationError(
                f"{folder / name}: {reason}; restore it, or plan from files of your own: copy {JOB} and what it names "
                "elsewhere, and give `geoprint plan` that job.",
            )
    return folder / JOB


def is_input(name: str) -> bool:
    """Return whether a file of a bundle is one that it is planned from."""
    folders = {CELL_FOLDER, TARGET_FOLDER, FIELD_FOLDER}
    return name in {JOB, PART, BODY, TARGET, FIELD, FEEDBACK} or PurePosixPath(name).parts[0] in folders


def _version(folder: Path) -> str:
    try:
        return str(json.loads((folder / PLAN).read_bytes())["version"])
    except (OSError, ValueError, KeyError, TypeError, RecursionError) as error:
        raise VerificationError(
            f"{folder / PLAN} cannot be read ({reason_of(error)}); write the plan again."
        ) from error


def _target_files(workpiece: Workpiece) -> dict[str, bytes]:
    """Return what layers shall fill; nothing where it is one thickness."""
    target = None if workpiece.place is None else workpiece.place.target
    if target is None:
        return {}
    return {TARGET if isinstance(target.content, Surface) else f"{TARGET_FOLDER}/{target.name}": target.stored}


def _field_files(workpiece: Workpiece) -> dict[str, bytes]:
    """Return the field file and, in a folder beside it, the files that it names; nothing without a field."""
    if workpiece.field is None:
        return {}
    text, named = workpiece.field.text, dict[str, bytes]()
    for (table, key), (name, content) in workpiece.field.files.items():
        beside = f"{FIELD_FOLDER}/{name}"
        if tomllib.loads(text)[table][key] != beside:
            text = edited(text, table=table, values={key: beside}, name=FIELD)
        named[beside] = content
    return {FIELD: text.encode("utf-8"), **named}


def _cell_files(workpiece: Workpiece) -> dict[str, bytes]:
    """Return the cell's file and, beside it, the arm's; nothing where the cell comes with geoprint."""
    text, name = workpiece.cell_text, workpiece.cell.name
    if text is None:
        return {}
    robot = tomllib.loads(text)["robot"]
    if "calibration" in robot:
        # The URDF of a calibrated arm has its calibration in it.
        robot = {"urdf": workpiece.cell.robot.model}
        text = edited(text, table="robot", values=robot | {"arm": None, "calibration": None}, name=name)
    urdf = robot.get("urdf")
    if urdf is None:
        return {f"{CELL_FOLDER}/{name}": text.encode("utf-8")}
    beside = Path(urdf).name
    if beside != urdf:
        text = edited(text, table="robot", values={"urdf": beside}, name=name)
    arm = (workpiece.cell.robot.urdf or "").encode("utf-8")
    return {f"{CELL_FOLDER}/{name}": text.encode("utf-8"), f"{CELL_FOLDER}/{beside}": arm}
