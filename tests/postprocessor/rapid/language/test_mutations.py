"""Two hundred mutations of a written program: names, types, number of arguments, storage, order. Each is found.

What would change nothing is not made: a CONST that becomes a VAR, modules or declarations in another order among their
like, arguments of one kind that change places, a name that nothing uses under another name.
"""

from __future__ import annotations

import random
import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache
from typing import TypeAlias

import pytest

from geoprint.errors import VerificationError
from geoprint.model import Signals
from geoprint.postprocessor.rapid import program as rapid
from geoprint.postprocessor.rapid.language.parsing import parse_module
from geoprint.postprocessor.rapid.language.symbols import read_task, resolve
from tests.postprocessor.export_cases import CELL, PLACEMENT, orders, proven_program, stream, tips_of

Modules: TypeAlias = dict[str, str]
# A mutation: the file and its new text, or None where the file is gone.
Change: TypeAlias = tuple[str, str | None]
SIGNALS = {"doValve": "signaldo", "doUV": "signaldo", "aoFlow": "signalao"}
WORD = r"[A-Za-z]\w*"
CODE = re.compile(r'"[^"\n]*"|![^\n]*')
DECLARED = re.compile(rf"\b(?:(?:VAR|PERS|CONST) {WORD}|PROC|FUNC {WORD}) ({WORD})")
# Events of the controller call these.
TIED = {"main", "GeoStopped"}


@pytest.fixture(scope="module")
def program() -> Modules:
    cell = replace(CELL, signals=Signals(mode="analog", dispenser="doValve", uv_lamp="doUV", flow="aoFlow",
                                         flow_per_mm3_s=2.0))  # fmt: skip
    poses = stream(runs=4, points=6)
    patch = pytest.MonkeyPatch()
    patch.setattr(rapid, "MODULE_LINES", 55)
    written, _ = proven_program(
        orders(poses), cell=cell, placement=PLACEMENT, surface_within=0.2, tips_at=tips_of(poses), part_name="rings",
        spacing=2.0,
    )  # fmt: skip
    patch.undo()
    return {name: text for name, text in written.modules if name.endswith(".mod")}


def bare(text: str) -> str:
    """Return a text with its strings and comments blanked out."""
    return CODE.sub(lambda match: " " * len(match[0]), text)


def names(modules: Modules) -> list[str]:
    """Return what is declared and used."""
    code = "\n".join(bare(text) for text in modules.values())
    late = "\n".join(re.findall(rf'%"({WORD})"%', "\n".join(modules.values())))
    found = sorted({name for text in modules.values() for name in DECLARED.findall(bare(text))} - TIED)
    return [name for name in found if len(re.findall(rf"\b{name}\b", f"{code}\n{late}", re.IGNORECASE)) > 1]


def changes(modules: Modules, pattern: str, by: str | Callable[[re.Match[str]], str]) -> Iterator[Change]:
    """Yield a change for each place in the code where a pattern stands."""
    for file, text in modules.items():
        for match in re.finditer(pattern, bare(text), re.MULTILINE):
            whole = re.compile(pattern, re.MULTILINE).match(text, match.start())
            if whole:
                new = whole.expand(by) if isinstance(by, str) else by(whole)
                yield file, text[: whole.start()] + new + text[whole.end() :]


def everywhere(modules: Modules, name: str, new: str) -> Modules:
    pattern = rf"(?<!\\)\b{name}\b"
    return {file: re.sub(pattern, new, text) for file, text in modules.items()}


Mutants: TypeAlias = Iterator[Modules]


def single(kind: Callable[[Modules], Iterator[Change]]) -> Callable[[Modules], Mutants]:
    def mutants(modules: Modules) -> Mutants:
        for file, text in kind(modules):
            if text != modules[file]:
                yield {one: (text or "") if one == file else old for one, old in modules.items()}

    return mutants


def use_renamed(modules: Modules) -> Iterator[Change]:
    for name in names(modules):
        yield from changes(modules, rf"(?<!PROC )(?<!\\)\b{name}\b(?!:=\S* *\n)(?=[^\n])", "geoNowhere")


def declaration_renamed(modules: Modules) -> Iterator[Change]:
    for name in names(modules):
        yield from changes(modules, rf"\b((?:VAR|PERS|CONST) {WORD}|PROC|FUNC {WORD}) {name}\b", r"\1 geoNowhere")


def declared_again(modules: Modules) -> Iterator[Change]:
    for name in names(modules):
        if not re.search(rf"^    VAR {WORD} {name}\b", "\n".join(modules.values()), re.MULTILINE):
            yield from changes(modules, r"^(MODULE \w+)$", rf"\1\n  VAR bool {name.swapcase()};")
            yield from changes(modules, r"^ENDMODULE$", f"  PROC {name.swapcase()}()\n  ENDPROC\nENDMODULE")


def long_name(modules: Modules) -> Mutants:
    for name in names(modules):
        yield everywhere(modules, name, name + "x" * (33 - len(name)))


def taken_name(modules: Modules) -> Mutants:
    """A reserved word, or what the controller brings."""
    for k, name in enumerate(names(modules)):
        local = re.search(rf"^    VAR {WORD} {name}\b", "\n".join(modules.values()), re.MULTILINE)
        yield everywhere(modules, name, ["STEP", "Trap", "with"][k % 3])
        if not local:
            yield everywhere(modules, name, ["MoveL", "Offs", "z10", "pos", "TOOL0"][k % 5])


def other_type(modules: Modules) -> Iterator[Change]:
    others = {"num": "string", "bool": "num", "tooldata": "wobjdata", "wobjdata": "tooldata", "speeddata": "zonedata",
              "zonedata": "speeddata", "triggdata": "num", "loadsession": "clock", "jointtarget": "robtarget",
              "pose": "pos", "pos": "pose", "robtarget": "confdata", "confdata": "orient", "string": "num"}  # fmt: skip
    for old, new in others.items():
        yield from changes(modules, rf"\b(VAR|PERS|CONST|FUNC) {old} (?=\w+)", rf"\1 {new} ")
        yield from changes(modules, rf"\b(VAR|PERS|CONST|FUNC) {old} (?=\w+)", r"\1 nosuchtype ")
        yield from changes(modules, rf"(?<=[(,]){old} (?=\w+[,)])", f"{new} ")


def other_storage(modules: Modules) -> Iterator[Change]:
    yield from changes(modules, r"\bPERS (?=tooldata|wobjdata)", "VAR ")
    yield from changes(modules, r"\bPERS (?=tooldata|wobjdata)", "CONST ")
    yield from changes(modules, r"\bVAR (?=\w+ \w+;)", "CONST ")
    yield from changes(modules, r"\bVAR (?=num geoOn|bool geoCutShort|bool far)", "CONST ")
    yield from changes(modules, r"\bVAR (?=triggdata|loadsession)", "PERS ")


def value_to_constant(modules: Modules) -> Iterator[Change]:
    for kind, name in sorted(set(re.findall(r"CONST (\w+) (\w+):=", "\n".join(modules.values())))):
        value = {"num": "1", "pos": "[0,0,0]"}.get(kind, name)
        yield from changes(modules, r"^    (?=GeoSafe;)", f"    {name}:={value};\n    ")


def persistent_expression(modules: Modules) -> Iterator[Change]:
    yield from changes(modules, r"(PERS num \w+:=\d+)(?=;)", r"\1+1")
    yield from changes(modules, r"(PERS num \w+:=)\d+(?=;)", r"\1nGeoTurn")
    yield from changes(modules, r"(PERS bool \w+:=)(\w+)(?=;)", r"\1NOT \2")
    yield from changes(modules, r"(CONST num \w+:=)[\d.]+(?=;)", r"\1geoSpeedPct")
    yield from changes(modules, r"(CONST num \w+:=)[\d.]+(?=;)", r"\1Abs(-1)")
    yield from changes(modules, r"(CONST \w+ \w+):=[^;]+(?=;)", r"\1")


def other_signal(modules: Modules) -> Iterator[Change]:
    yield from changes(modules, r"\bdo(?:Valve|UV)\b", "doNowhere")
    yield from changes(modules, r"(?<!IF )\bdo(?:Valve|UV)\b", "aoFlow")
    yield from changes(modules, r"\baoFlow\b", "doUV")
    yield from changes(modules, r"(?<=SetDO )do\w+", "geoOn")


def swapped_arguments(modules: Modules) -> Iterator[Change]:
    yield from changes(modules, r",(v\w+),(\w+),(tGeoNozzle)", r",\2,\1,\3")
    yield from changes(modules, r",(z\w+|fine),(tGeoNozzle)", r",\2,\1")
    yield from changes(modules, r"(SetDO|SetAO|TriggIO|TriggSpeed) (\w+),([\d.]+)", r"\1 \3,\2")
    yield from changes(modules, r",(v\w+),(tGeo\w+)(?=[,\\])", r",\2,\1")
    yield from changes(modules, r"PoseVect\((\w+),(\w+)\)", r"PoseVect(\2,\1)")
    yield from changes(modules, r"^(    MoveL) (\[.*\]\]),(v\w+)", r"\1 \3,\2")


def dropped_argument(modules: Modules) -> Iterator[Change]:
    yield from changes(modules, r",tGeoNozzle(?=[\\;])", "")
    yield from changes(modules, r",(?:z\w+|fine)(?=,tGeoNozzle)", "")
    yield from changes(modules, r"^(    (?:SetDO|SetAO|VelSet) \w+),\w+;", r"\1;")
    yield from changes(modules, r"^(    (?:PDispSet|GeoEnter|GeoEnd|GeoBegin|WaitLoad)) \w+;", r"\1;")
    yield from changes(modules, r"(?<=\w)\((\w+(?:\.\w+)?),[^()]+\)", r"(\1)")
    yield from changes(modules, r"\\DOp:=\w+,\w+;", ";")


def further_argument(modules: Modules) -> Iterator[Change]:
    yield from changes(modules, r"(?<=tGeoNozzle)\\WObj:=wGeoPart;", r",wGeoPart\\WObj:=wGeoPart;")
    yield from changes(modules, r"^(    (?:SetDO|SetAO|VelSet|GeoEnter|GeoEnd|GeoBegin) [^;]+);", r"\1,1;")
    yield from changes(modules, r"^    (GeoSafe|TPErase|PDispOff|EOffsOff);", r"    \1 1;")
    yield from changes(modules, r"(CJointT)\(\)", r"\1(1)")
    yield from changes(modules, r"(?<=\w)(\(\w+(?:\.\w+)?)\)", r"\1,1)")


def wrong_option(modules: Modules) -> Iterator[Change]:
    yield from changes(modules, r"\\WObj:=", r"\\Work:=")
    yield from changes(modules, r"(\\WObj:=\w+)", r"\1\1")
    yield from changes(modules, r"(Conf[JL])\\On", r"\1\\On\\Off")
    yield from changes(modules, r"\\NoEOffs", r"\\NoEOffs:=1")
    yield from changes(modules, r"\\Start", r"\\Start\\Time\\Next")
    yield from changes(modules, r"\\T:=[^,]+,", r"\\T,")
    yield from changes(modules, r"(\\WObj):=\w+", r"\1")
    yield from changes(modules, r"\\NoEOffs,vGeo", r",vGeo\\NoEOffs,vGeo")


def wrong_kind(modules: Modules) -> Iterator[Change]:
    yield from changes(modules, r"(?<=^    IF )[^;]*?(?= THEN$)", "5")
    yield from changes(modules, r"(?<=:=)(?:TRUE|FALSE)(?=;)", "1")
    yield from changes(modules, r"(?<=geoOn:=)\d", "TRUE")
    yield from changes(modules, r"(?<=SetDO )(\w+),\d", r'\1,"0"')
    yield from changes(modules, r"(?<=GeoEnter )\d", '"1"')
    yield from changes(modules, r"\.robax\b", ".robix")
    yield from changes(modules, r"(\[\[-?[\d.]+,-?[\d.]+),-?[\d.]+\]", r"\1]")
    yield from changes(modules, r"\],\[9E9,9E9,9E9,9E9,9E9,9E9\]\]", "]]")


def wrong_routine(modules: Modules) -> Iterator[Change]:
    yield from changes(modules, r"^    (GeoSafe|GeoAskHome|PDispOff);", r"    geoOn:=\1();")
    yield from changes(modules, r"^    (GeoSafe);", r"    \1:=1;")
    yield from changes(modules, r"\bCJointT\(\)", "CJointT")
    yield from changes(modules, r"^    PDispOff;", "    Abs 1;")
    yield from changes(modules, r"^    RETURN \w+;", "    RETURN;")
    yield from changes(modules, r"^    GeoSafe;", "    RETURN 1;")
    yield from changes(modules, r"^    (?=GeoEnter)", "    RETRY;\n    ")
    yield from changes(modules, r"^    (?=GeoEnter)", "    RAISE;\n    ")
    yield from changes(modules, r"^    (?=GeoEnter)", "    GOTO nowhere;\n    ")


def other_order(modules: Modules) -> Iterator[Change]:
    yield from changes(modules, r"^  ENDPROC\nENDMODULE$", "  ENDPROC\n  VAR num geoLate;\nENDMODULE")
    yield from changes(modules, r"^    GeoSafe;\n(?=  ERROR|  ENDPROC)", "    GeoSafe;\n    VAR num late;\n")
    yield from changes(modules, r"^  END(?:PROC|FUNC)\n", "")
    yield from changes(modules, r"^    ENDIF\n", "")
    yield from changes(modules, r"^    ELSE\n", "    ELSE\n    ELSE\n")
    yield from changes(modules, r"^MODULE \w+\n", "")


def late_call(modules: Modules) -> Iterator[Change]:
    for file, text in modules.items():
        for match in re.finditer(rf'%"({WORD})"%', text):
            for by in ('%"GeoRun9"%', '%"geoOn"%', "%geoOn%", '%"GeoAloft"%', f'%"{match[1]}"% 1'):
                yield file, text[: match.start()] + by + text[match.end() :]


def other_module(modules: Modules) -> Mutants:
    """A module is missing, is there twice, or has the name of another."""
    for file in modules:
        # Nothing calls main but the controller.
        if file != "GeoPrint.mod":
            yield {other: text for other, text in modules.items() if other != file}
        yield modules | {"Again.mod": modules[file]}
        for other in modules:
            if other != file:
                name = other.removesuffix(".mod")
                yield modules | {file: re.sub(r"^MODULE \w+", f"MODULE {name}", modules[file])}


KINDS: dict[str, Callable[[Modules], Mutants]] = {
    **{
        kind.__name__: single(kind)
        for kind in (
            use_renamed, declaration_renamed, declared_again, other_type, other_storage, value_to_constant,
            persistent_expression, other_signal, swapped_arguments, dropped_argument, further_argument, wrong_option,
            wrong_kind, wrong_routine, other_order, late_call,
        )
    },
    **{kind.__name__: kind for kind in (long_name, taken_name, other_module)},
}  # fmt: skip
MUTATIONS = 200


def test_the_program_itself_is_right(program: Modules) -> None:
    assert read_task(tuple(program.items()), signals=SIGNALS).open_names == ()


def test_each_of_two_hundred_mutations_is_found(program: Modules) -> None:
    chance = random.Random(18)  # noqa: S311
    mutants = {kind: list(make(program)) for kind, make in KINDS.items()}
    missed: list[str] = []
    parsed = cache(parse_module)
    for k in range(MUTATIONS):
        kind = list(KINDS)[k % len(KINDS)]
        mutant = mutants[kind].pop(chance.randrange(len(mutants[kind])))
        try:
            # As `read_task` does; most modules of a mutant are as they were, and are parsed once.
            resolve([parsed(file, text) for file, text in mutant.items()], signals=SIGNALS)
        except VerificationError:
            continue
        missed.append(f"{kind}: {_difference(program, mutant)}")
    assert missed == []


def _difference(program: Modules, mutant: Modules) -> str:
    return "; ".join(
        f"{file}: {line.strip()[:90]}"
        for file, text in mutant.items()
        for line in text.split("\n")
        if line not in program.get(file, "").split("\n")
    )
