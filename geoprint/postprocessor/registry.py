"""Every post-processor by its name: built in, registered or from a package; the cell chooses one."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType

from geoprint import features
from geoprint.errors import UsageError
from geoprint.model import Cell
from geoprint.postprocessor.interface import Joining, PostProcessor
from geoprint.postprocessor.rapid.post_processor import Rapid
from geoprint.postprocessor.trajectory.post_processor import JointTrajectory
from geoprint.postprocessor.urscript.post_processor import UrScript
from geoprint.registry import Factory, Registry

POST_PROCESSORS: Mapping[str, Factory[PostProcessor]] = MappingProxyType(
    {"rapid": Rapid, "urscript": UrScript, "joint-trajectory": JointTrajectory}
)
# Of a cell that names none.
DEFAULT = "rapid"

_KNOWN = Registry(
    "post-processor",
    group=features.POST_PROCESSORS,
    built_in=POST_PROCESSORS,
    members=(
        "title",
        "joining",
        "check_cell",
        "check_arm",
        "driven",
        "write",
        "as_written",
        "execute",
        "check",
        "dispensing",
        "handling",
    ),
)


def register(name: str, factory: Factory[PostProcessor]) -> None:
    """Register a post-processor under a name until the program ends; a package declares an entry point instead.

    Raises:
        UsageError: the name is invalid or in use, or the class lacks what a post-processor needs.
    """
    _KNOWN.register(name, factory)


def post_processor(name: str) -> PostProcessor:
    """Return a post-processor by its name.

    Raises:
        UsageError: there is none of that name or more than one, or a package's cannot be loaded.
    """
    return _KNOWN.find(name).factory()


def post_processor_names() -> tuple[str, ...]:
    """Return the names of all post-processors: each is the folder of its programs in a bundle, too."""
    return _KNOWN.names


def post_processor_name(cell: Cell) -> str:
    """Return the name of the post-processor of a cell, which is the folder of its programs in a bundle, too.

    Raises:
        UsageError: as `post_processor`.
    """
    return _KNOWN.find(cell.robot.post_processor or DEFAULT).name


def post_processor_of(cell: Cell) -> PostProcessor:
    """Return the post-processor of a cell.

    Raises:
        UsageError: as `post_processor`.
    """
    return post_processor(post_processor_name(cell))


def is_as_written(path: Path, digest: str) -> bool:
    """Return whether a file has the hash that a manifest lists, as it stands or with its settings as in a new program.

    Args:
        path: of a plain file; the folder of a program is named after its post-processor.
        digest: SHA-256 that is listed.
    """
    content = path.read_bytes()
    dialect = next((folder for folder in reversed(path.parts[:-1]) if folder in post_processor_names()), "")
    return digest in {hashlib.sha256(each).hexdigest() for each in (content, as_written(dialect, path.name, content))}


def as_written(dialect: str, name: str, content: bytes) -> bytes:
    """Return a file of a program with its settings as in a new program.

    Args:
        dialect: name of the post-processor; empty where there is none.
        name: of the file; it may hold settings or not.
        content: of it.
    """
    if not dialect:
        return content
    return post_processor(dialect).as_written(name, content.decode("latin-1")).encode("latin-1")


def joining_of(cell: Cell) -> Joining:
    """Return how programs of several parts become one in a cell.

    Raises:
        UsageError: its post-processor cannot join them.
    """
    joining = post_processor_of(cell).joining
    if joining is None:
        raise UsageError(
            f"the post-processor '{post_processor_name(cell)}' writes programs of one part alone: print without table "
            "and layers, or choose another post_processor under [robot]."
        )
    return joining


def joined_file(cell: Cell) -> str:
    """Return the file that a person loads of a program of several parts, in the bundle.

    Raises:
        UsageError: as `joining_of`.
    """
    return f"{post_processor_name(cell)}/{joining_of(cell).file}"
