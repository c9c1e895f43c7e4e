"""Compares the program of a stack with those of its layers: its text line by line, and what it does, executed."""

from __future__ import annotations

import re
import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from importlib import resources

import numpy as np

from geoprint import transforms
from geoprint.errors import VerificationError, how_many
from geoprint.model import FloatArray
from geoprint.postprocessor.execution import OwnProgram, StackProof, StackSettings
from geoprint.postprocessor.rapid.guard import GUARD, check_guard, resident_module
from geoprint.postprocessor.rapid.language.parsing import parse_module, uncollected
from geoprint.postprocessor.rapid.language.symbols import examine
from geoprint.postprocessor.rapid.language.syntax import Module, Place, refusal, refuse
from geoprint.postprocessor.rapid.made import signals_of
from geoprint.postprocessor.rapid.reader import check_line, read_program_file, read_text
from geoprint.postprocessor.rapid.settings import CELL_MODULE, STACK_MODULE, as_new, read_stack_settings, unit_of
from geoprint.postprocessor.rapid.stack_running import StackRun

_LIST, _PRINT = "GeoStack.pgf", "GeoPrint.mod"
_ENTRY = re.compile(r"  PROC (Geo(?:Layer|Attitude)\d+_(\d+))\(\)")
# Places of one part on the plate of a table differ by roundings only [mm].
_STANDING = 1e-6
# The number that the pendant shows of an attitude: it counts on from layer to layer.
_TABLE = re.compile(r"  CONST num nGeoTable:=\d+;")
# What GeoStack declares in place of a layer.
_SWITCH = re.compile(r"  PERS (?:bool geoDryRun|num geoSpeedPct|num geoFirstRun):=")


@uncollected()
def judge_stack(
    files: Mapping[str, str], layers: Sequence[OwnProgram]
) -> tuple[tuple[VerificationError, ...], StackProof | None, StackSettings | None]:
    """Return what is wrong with the program of a stack, and what it did when it was executed.

    Every line of a layer must be that of its own program, but for its folder, the name of its main, the switches and
    the guard, which has a text for stacks; GeoStack and the guard are compared word for word with what geoprint brings.

    Args:
        files: text of each file by its path in the folder of the program; those of the controller are left out.
        layers: their own programs, the lowest first.

    Returns:
        The first finding of each module, then the first of its execution; its executions, None where it does not run;
        and how it is set to run, None where a switch stands at a value that it refuses.
    """
    first, unit = layers[0], unit_of(layers[0].placement)
    resident = parse_module(*resident_module(first.cell, first.placement))
    findings = [*_list_findings(files)]
    entries = [_entry_of(files, layer) for layer in layers]
    for number, (layer, entry) in enumerate(zip(layers, entries, strict=True), start=1):
        findings += _layer_findings(files, layer, number=number, entry=entry)
    findings += _failing(lambda: _check_stack(files, layers, entries))
    brought = {STACK_MODULE, *(f"{layer.folder}/{name}" for layer in layers for name, _ in _modules(layer))}
    known = brought | {_LIST}
    findings += [
        refusal(Place(name, 1), "no layer of the stack has this module") for name in sorted(files.keys() - known)
    ]
    parsed, broken = _parsed({name: text for name, text in files.items() if name in known})
    findings += broken
    proofs: list[StackProof] = []
    if not broken and brought <= files.keys():
        unresolved = _unresolved(parsed, resident, layers)
        findings += unresolved
        if not unresolved:
            findings += _failing(lambda: proofs.append(_prove([*parsed.values(), resident], layers, resident)))
    settings: list[StackSettings] = []
    for proof in proofs:
        text = read_text([parsed[STACK_MODULE]])
        findings += _failing(
            lambda text=text, proof=proof: settings.append(read_stack_settings(text, runs=proof.runs, unit=unit))
        )
    return tuple(findings), proofs[0] if proofs else None, settings[0] if settings else None


def verify_stack(files: Mapping[str, str], layers: Sequence[OwnProgram]) -> StackProof:
    """Check the program of a stack before it is written.

    Args:
        files: as `judge_stack`.
        layers: as `judge_stack`.

    Raises:
        VerificationError: it is not what its layers are; file, line and reason are named.
    """
    findings, proof, _ = judge_stack(files, layers)
    for finding in findings:
        raise finding
    text = files[STACK_MODULE]
    if as_new(text) != text:
        refuse(Place(STACK_MODULE, 1), "the switches of a new program stand at other values than they must")
    assert proof is not None  # noqa: S101  # Without a finding it ran.
    return proof


def _prove(modules: Sequence[Module], layers: Sequence[OwnProgram], resident: Module) -> StackProof:
    own = [
        (layer.folder, [*(parse_module(name, text) for name, text in _modules(layer)), resident]) for layer in layers
    ]
    _check_standing(layers)
    # Of the last one: only behind that the part is exposed as a whole.
    ends = [number for number, layer in enumerate(layers[:-1], start=1) if layers[number].layer != layer.layer]
    return StackRun(modules, own, ends=ends, cell=layers[-1].cell, placement=layers[0].placement).prove()


def _check_standing(layers: Sequence[OwnProgram]) -> None:
    """Check that the attitudes of each layer follow one another, and that the part stands on the plate alike in all."""
    if layers[0].placement.table is None or layers[0].cell.table is None:
        return
    T_base_table = layers[0].cell.table.T_base_table
    at_rest: list[FloatArray] = []
    number, before = 0, layers[0].layer
    for layer in layers:
        number, before = number + 1 if layer.layer == before else 1, layer.layer
        pose, place = layer.placement.table, Place(f"{layer.folder}/{CELL_MODULE}", 1)
        if pose is None or pose.number != number:
            refuse(place, f"attitude {number} of the table must be printed here, found {pose and pose.number}")
        T_table_plate = transforms.inverse(T_base_table) @ layer.placement.T_base_work
        at_rest.append(transforms.inverse(pose.T_table_plate) @ T_table_plate)
        if np.abs(at_rest[-1] - at_rest[0]).max() > _STANDING:
            refuse(place, "the part stands elsewhere on the plate of the table than in the first attitude")


def _modules(layer: OwnProgram) -> list[tuple[str, str]]:
    return [(name, text) for name, text in layer.modules if name.endswith(".mod")]


def _parsed(files: Mapping[str, str]) -> tuple[dict[str, Module], list[VerificationError]]:
    parsed: dict[str, Module] = {}
    broken: list[VerificationError] = []
    for name, text in files.items():
        if name.endswith(".mod"):
            broken += _failing(lambda name=name, text=text: parsed.update({name: parse_module(name, text)}))
    return parsed, broken


def _unresolved(
    parsed: Mapping[str, Module], resident: Module, layers: Sequence[OwnProgram]
) -> list[VerificationError]:
    """Return what does not resolve: in GeoStack without any layer, and in each layer beside it."""
    signals = signals_of(layers[0].cell)
    standing = [parsed[STACK_MODULE], resident]
    _, errors = examine(standing, signals=signals)
    for layer in layers:
        own = [module for name, module in parsed.items() if name.startswith(f"{layer.folder}/")]
        errors += examine([*standing, *own], signals=signals)[1]
    return errors


def _entry_of(files: Mapping[str, str], layer: OwnProgram) -> str:
    """Return the procedure that prints a layer, as its module names it, or nothing."""
    match = _ENTRY.search(files.get(f"{layer.folder}/{_PRINT}", ""))
    return match[1] if match else ""


def _list_findings(files: Mapping[str, str]) -> Iterator[VerificationError]:
    def check() -> None:
        if _LIST not in files:
            refuse(Place(_LIST, 1), "the list of modules is missing")
        if read_program_file(_LIST, files[_LIST]) != (STACK_MODULE,):
            refuse(Place(_LIST, 3), f"it must list {STACK_MODULE} alone: layers are loaded in their turn")

    yield from _failing(check)


def _layer_findings(files: Mapping[str, str], layer: OwnProgram, *, number: int, entry: str) -> list[VerificationError]:
    """Return the first line of each module that is not that of the layer's own program, or that its sum is another."""
    findings: list[VerificationError] = []
    loading = any(name.startswith("GeoPath") for name, _ in layer.modules)
    bare: list[str] = []
    for name, own in _modules(layer):
        path = f"{layer.folder}/{name}"
        text = files.get(path)
        if text is None:
            findings.append(refusal(Place(path, 1), "this module of the layer is missing"))
        elif name == GUARD:
            findings += _failing(lambda path=path, text=text: _check_guard(path, text, layer, loading=loading))
        else:
            wanted = _wanted_lines(name, own, number=number)
            findings += _failing(
                lambda path=path, text=text, wanted=wanted: _check_lines(path, text, wanted, layer, entry)
            )
        bare.append((text or "").replace(f"  PROC {entry}()\n", "  PROC main()\n", 1) if name == _PRINT else text or "")
    sum_of = zlib.crc32("".join(bare).encode("latin-1")) % 1_000_000
    wanted = f"Geo{unit_of(layer.placement)}{number}_{sum_of}"
    if not findings and entry != wanted:
        place = Place(f"{layer.folder}/{_PRINT}", 1)
        findings.append(
            refusal(place, f"the {unit_of(layer.placement).lower()}'s procedure must be {wanted}, found {entry!r}")
        )
    return findings


def _check_guard(path: str, text: str, layer: OwnProgram, *, loading: bool) -> None:
    try:
        check_guard(text, cell=layer.cell, placement=layer.placement, loading=loading, stacked=True)
    except VerificationError as error:
        line, reason = error.details.get("line"), error.details.get("reason")
        refuse(Place(path, line if isinstance(line, int) else 1), str(reason))


def _wanted_lines(name: str, own: str, *, number: int) -> list[str]:
    """Return the lines of a module of a layer's own program, but for what a stack holds once and numbers through."""
    lines = own.split("\n")
    if name != CELL_MODULE:
        return lines
    shown = f"  CONST num nGeoTable:={number};"
    return [shown if _TABLE.fullmatch(line) else line for line in lines if not _SWITCH.match(line)]


def _check_lines(path: str, text: str, wanted: Sequence[str], layer: OwnProgram, entry: str) -> None:
    """Check that the lines of a module are those that the layer's own program asks for."""
    name = path.rpartition("/")[2]
    found = text.split("\n")
    for number, line in enumerate(found, start=1):
        place = Place(path, number)
        check_line(line, place)
        if number > len(wanted):
            refuse(place, f"{line.strip()[:60]!r} follows the end of the module")
        said = line
        if name == _PRINT:
            said = line.replace(f'"{layer.folder}/GeoPath', '"GeoPath')
            said = "  PROC main()" if entry and line == f"  PROC {entry}()" else said
        if said != wanted[number - 1]:
            refuse(
                place,
                f"the layer's own program says {wanted[number - 1].strip()[:80]!r} here, found {line.strip()[:80]!r}",
            )
    if len(found) < len(wanted):
        refuse(Place(path, len(found)), f"the module ends before {wanted[len(found)].strip()[:80]!r}")


def _check_stack(files: Mapping[str, str], layers: Sequence[OwnProgram], entries: Sequence[str]) -> None:
    """Check GeoStack word for word against what geoprint brings; its comments say nothing to a controller."""
    if STACK_MODULE not in files:
        refuse(Place(STACK_MODULE, 1), "the module is missing")
    wanted = [line for line in _expected(layers, entries) if not line.lstrip().startswith("!")]
    lines = as_new(files[STACK_MODULE]).split("\n")
    found = [(number, line) for number, line in enumerate(lines, start=1) if not line.lstrip().startswith("!")]
    for number, line in enumerate(lines, start=1):
        check_line(line, Place(STACK_MODULE, number))
    for (number, line), word in zip(found, wanted, strict=False):
        if line != word:
            refuse(Place(STACK_MODULE, number), f"it must say {word.strip()!r} here, found {line.strip()[:80]!r}")
    if len(found) != len(wanted):
        refuse(
            Place(STACK_MODULE, len(lines)),
            f"it must have {how_many(len(wanted), 'line')} without comments, found {len(found)}",
        )


def _expected(layers: Sequence[OwnProgram], entries: Sequence[str]) -> Iterator[str]:
    """Yield the lines of GeoStack for these layers."""
    missing, pause = bool(layers[0].placement.missing), layers[0].cell.process.layer_pause
    unit = unit_of(layers[0].placement)
    tilted = unit == "Attitude"
    holds = {
        "known": not missing, "unknown": missing, "pause": pause > 0.0 and layers[0].layer != layers[-1].layer,
        "attitudes": tilted, "layers": not tilted,
    }  # fmt: skip
    words = {"<UNIT>": unit, "<LOWER>": unit.lower(), "<WHOLE>": "program" if tilted else "stack"}
    words |= {"<COUNT>": str(len(layers)), "<PAUSE>": f"{pause:.6G}"}
    template = resources.files("geoprint.postprocessor.rapid").joinpath("geo_stack.mod").read_text(encoding="ascii")
    for line in template.split("\n"):
        condition = re.match(r"@([a-z]+)\|", line)
        bare = line if condition is None else line[condition.end() :]
        if condition is not None and not holds[condition[1]]:
            continue
        if bare == "<FORGETTING>":
            for layer in layers:
                for name, _ in reversed(_modules(layer)):
                    yield f'    GeoStackForget "{layer.folder}/{name}";'
        elif bare == "<PRINTING>":
            for number, (layer, entry) in enumerate(zip(layers, entries, strict=True), start=1):
                yield f'    GeoStack{unit} {number},"{layer.folder}","{entry}";'
                if holds["pause"] and number < len(layers) and layers[number].layer != layer.layer:
                    yield f"    GeoStackPause {number};"
        elif bare != "<HEADER>":
            yield re.sub("<[A-Z]+>", lambda match: words[match[0]], bare)


def _failing(check: Callable[[], object]) -> Iterator[VerificationError]:
    """Yield what a check raises."""
    try:
        check()
    except VerificationError as error:
        yield error
