"""Several verified programs made into one that loads each in its turn: layers, attitudes of a table, or both."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import PurePosixPath

from geoprint.export.rapid.controller_files import CONTROLLER_FOLDER, controller_files
from geoprint.export.rapid.stacks.running import StackProof
from geoprint.export.rapid.stacks.verifying import OwnProgram, verify_stack
from geoprint.export.rapid.stacks.writing import stack_files, stacked_layer


def together(own: Sequence[OwnProgram], *, part_name: str) -> tuple[dict[str, str], dict[str, str], StackProof]:
    """Return the program of several, verified.

    Args:
        own: their own programs, in the order of printing.
        part_name: for the header.

    Returns:
        Text of each of its modules and of what a controller needs before the first load, by their paths in the folder
        of the program; and what was executed of it.

    Raises:
        VerificationError: the program, read back and executed, is not what they are.
    """
    # The last cell has all that is done: only behind that one the part is exposed as a whole.
    cell, placement = own[-1].cell, own[0].placement
    made = [
        stacked_layer(
            one.modules, number=number, layer=one.layer, folder=one.folder, cell=one.cell, placement=placement
        )
        for number, one in enumerate(own, start=1)
    ]
    modules = dict(stack_files(made, cell=cell, placement=placement, part_name=part_name))
    proof = verify_stack(modules, own)
    loading = any(PurePosixPath(name).name.startswith("GeoPath") for name in modules)
    folders = [one.folder for one in own]
    kept = controller_files(cell, placement=placement, loading=loading, folders=folders)
    return modules, {f"{CONTROLLER_FOLDER}/{name}": text for name, text in kept.items()}, proof
