"""The RAPID program of several verified programs: GeoStack, whose main loads one layer after the other."""

from __future__ import annotations

import re
import zlib
from collections.abc import Sequence
from dataclasses import replace
from importlib.metadata import version
from itertools import pairwise
from pathlib import PurePosixPath

from geoprint.model import Cell, Placement
from geoprint.postprocessor.execution import OwnProgram, StackProof
from geoprint.postprocessor.interface import CONTROLLER_FOLDER
from geoprint.postprocessor.rapid import writing
from geoprint.postprocessor.rapid.cell_module import guard_module, program_file
from geoprint.postprocessor.rapid.controller_files import controller_files
from geoprint.postprocessor.rapid.settings import CELL_MODULE, STACK_MODULE
from geoprint.postprocessor.rapid.stack_verifying import verify_stack
from geoprint.postprocessor.rapid.templates import conditions, filled, unit_words

# The RAPID program of a stack: GeoStack, whose main loads one layer after the other, and the layers' own modules.
#
# Each layer is the program that was written and verified for it, but for what a task holds only once: its `main` has
# another name, its switches stand in GeoStack, its modules lie in a folder of their own. What GeoStack does between
# them moves nothing: each ends at home with everything shut off, where the next begins. Over a table the parts are
# attitudes, those of one layer after those of another, numbered through; the pause comes between layers alone.
#
# What [ABBRapid] says of modules that come and go decides its form. A procedure of a module that is loaded later is
# called by late binding alone (`%entry%`; ERR_REFUNKPRC where no loaded module has it), and data of such a module
# cannot be named at all: so the layers name data of GeoStack, and GeoStack none of theirs. `UnLoad` forgets what
# persistents were set to, so what a person sets and what must outlast a layer stands in GeoStack. Two loaded modules
# must not declare the same name, so a layer is forgotten before the next is loaded (`UnLoad` with the path that it
# was loaded by; ERR_UNLOAD where it is not there). Nothing moves meanwhile, so `Load` waits as well as `StartLoad`
# with `WaitLoad`; `\Dynamic` lets PP to main unload what a stop has left, and main forgets it once more by itself.


_GUARD, _PRINT = "GeoGuard.mod", "GeoPrint.mod"
# The number of an attitude as its pendant shows it, which counts on over all layers.
_TABLE = re.compile(r"(?m)^  CONST num nGeoTable:=\d+;$")
# What GeoStack declares in place of a layer's GeoCell.
_SWITCHES = ("PERS bool geoDryRun:=", "PERS num geoSpeedPct:=", "PERS num geoFirstRun:=")
# A RAPID num and six digits in a name are enough to tell two layers apart.
_LARGEST_SUM = 1_000_000

# The list that a person loads.
STACK_LIST = "GeoStack.pgf"


def stacked_layer(own: OwnProgram, *, number: int) -> tuple[str, OwnProgram]:
    """Return the procedure that prints a layer of a stack, and the layer made of its own program; likewise an attitude.

    Args:
        own: as it was written; lists of modules are left out.
        number: of the layer or the attitude, from 1 on through the whole program.
    """
    loading = any(name.startswith("GeoPath") for name, _ in own.modules)
    guard = guard_module(own.cell, placement=own.placement, loading=loading, stacked=True)
    placed: dict[str, str] = {}
    for name, text in own.modules:
        if name == CELL_MODULE:
            lines = text.split("\n")
            bare = "\n".join(line for line in lines if not line.lstrip().startswith(_SWITCHES))
            placed[name] = _TABLE.sub(f"  CONST num nGeoTable:={number};", bare)
        elif name == _PRINT:
            placed[name] = text.replace('"GeoPath', f'"{own.folder}/GeoPath')
        elif name.endswith(".mod"):
            placed[name] = guard if name == _GUARD else text
    sum_of = zlib.crc32("".join(placed.values()).encode("ascii")) % _LARGEST_SUM
    entry = f"Geo{unit_words(own.placement)['UNIT']}{number}_{sum_of}"
    placed[_PRINT] = placed[_PRINT].replace("  PROC main()\n", f"  PROC {entry}()\n", 1)
    return entry, replace(own, modules=tuple(placed.items()))


def stack_files(
    layers: Sequence[tuple[str, OwnProgram]], *, cell: Cell, placement: Placement, part_name: str
) -> tuple[tuple[str, str], ...]:
    """Return file and text of GeoStack, of the list of modules that names it, and of all modules of the layers.

    Args:
        layers: as `stacked_layer` returns them, the lowest first.
        cell: its name, arm and pause.
        placement: whether all of it was stated.
        part_name: for the header.
    """
    inner = [(f"{layer.folder}/{name}", text) for _, layer in layers for name, text in layer.modules]
    stack = _stack_module(layers, cell=cell, placement=placement, part_name=part_name)
    return (STACK_MODULE, stack), (STACK_LIST, program_file([STACK_MODULE])), *inner


def layer_ends(layers: Sequence[int]) -> list[int]:
    """Return behind which parts of a program another layer begins.

    Args:
        layers: the layer that each part prints.

    Examples:
        >>> layer_ends([1, 1, 2, 2, 2, 3])
        [2, 5]
    """
    return [number for number, (one, other) in enumerate(pairwise(layers), start=1) if one != other]


def _attitudes_of(layers: Sequence[OwnProgram]) -> list[str]:
    """Return which attitudes print each layer, a line a layer."""
    last = [*layer_ends([each.layer for each in layers]), len(layers)]
    first = [1, *(number + 1 for number in last[:-1])]
    return [
        f"Layer {layers[begin - 1].layer}: attitude{f's {begin} to' if end > begin else ''} {end}."
        for begin, end in zip(first, last, strict=True)
    ]


def _stack_module(
    entered: Sequence[tuple[str, OwnProgram]], *, cell: Cell, placement: Placement, part_name: str
) -> str:
    layers = [layer for _, layer in entered]
    holding = conditions(cell, placement=placement, loading=True, stacked=True)
    pause = cell.process.layer_pause
    words = unit_words(placement)
    one, tilted = words["LOWER"], placement.table is not None
    ends = layer_ends([layer.layer for layer in layers])
    holding |= {"pause"} if pause > 0.0 and ends else set()
    holding.add("attitudes" if tilted else "layers")
    forgetting = [
        f'    GeoStackForget "{layer.folder}/{name}";' for layer in layers for name, _ in reversed(layer.modules)
    ]
    printing: list[str] = []
    for number, (entry, layer) in enumerate(entered, start=1):
        printing.append(f'    GeoStack{words["UNIT"]} {number},"{layer.folder}","{entry}";')
        printing += [f"    GeoStackPause {number};"] if pause > 0.0 and number in ends else []
    header = [
        f"Written by geoprint {version('geoprint')}. Do not edit: change the plan and write it again.",
        f"Part: {part_name}",
        f"Cell: {cell.name}; robot: {cell.robot.model}",
        f"{len(layers)} {one}s, loaded in turn from HOME:, so copy their folders there first.",
        *(_attitudes_of(layers) if tilted and ends else ()),
        f"Checked: executed from home to home; each {one} moves and switches as in its own program.",
        "Not checked: the real cell. Run it dry and slowly first.",
        "It needs GeoResident.sys, which shuts outputs off at stops: controller/first_load.md.",
    ]
    words |= {
        "HEADER": "\n".join(line for text in header for line in writing.comment(text)),
        "COUNT": str(len(layers)),
        "PAUSE": writing.significant(pause),
        "FORGETTING": "\n".join(forgetting),
        "PRINTING": "\n".join(printing),
    }
    return filled("geo_stack.mod", holding=holding, words=words)


# Several verified programs made into one that loads each in its turn: layers, attitudes of a table, or both.


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
    made = [stacked_layer(replace(one, placement=placement), number=number) for number, one in enumerate(own, start=1)]
    modules = dict(stack_files(made, cell=cell, placement=placement, part_name=part_name))
    proof = verify_stack(modules, own)
    loading = any(PurePosixPath(name).name.startswith("GeoPath") for name in modules)
    folders = [one.folder for one in own]
    kept = controller_files(cell, placement=placement, loading=loading, folders=folders)
    return modules, {f"{CONTROLLER_FOLDER}/{name}": text for name, text in kept.items()}, proof
