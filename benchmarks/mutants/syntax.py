"""Small changes of a module's syntax tree, each of which a test should notice.

A comparison is turned or its bound let in, a term or a factor dropped, a sign turned, `and` made `or`, a number scaled,
an early return or a refusal left out, the least made the largest. What only people read (docstrings, messages), types
and imports are left alone, and so are decorators, `strict=` of `zip`, and arguments that name a memory's kind.
"""

from __future__ import annotations

import ast
import copy
import re
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from typing import final

_COMPARED: dict[type[ast.cmpop], tuple[type[ast.cmpop], ...]] = {
    ast.Lt: (ast.LtE, ast.Gt), ast.LtE: (ast.Lt, ast.GtE), ast.Gt: (ast.GtE, ast.Lt), ast.GtE: (ast.Gt, ast.LtE),
    ast.Eq: (ast.NotEq,), ast.NotEq: (ast.Eq,), ast.Is: (ast.IsNot,), ast.IsNot: (ast.Is,), ast.In: (ast.NotIn,),
    ast.NotIn: (ast.In,),
}  # fmt: skip
_COMBINED: dict[type[ast.operator], type[ast.operator]] = {
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.BitOr: ast.BitAnd,
    ast.BitAnd: ast.BitOr,
}  # fmt: skip
_CALLED = {
    "min": "max", "max": "min", "minimum": "maximum", "maximum": "minimum", "any": "all", "all": "any",
    "ceil": "floor", "floor": "ceil", "sin": "cos", "cos": "sin", "argmin": "argmax", "argmax": "argmin",
}  # fmt: skip
# Arguments that change nothing that a test could see, or nothing but how fast it goes.
_SILENT = (
    "strict",
    "dtype",
    "cache",
    "copy",
    "encoding",
    "key",
    "description",
    "help",
    "stacklevel",
    "frozen",
    "slots",
    "eq",
)


@final
@dataclass(frozen=True, slots=True)
class Mutant:
    """A change of a file.

    Attributes:
        file: path below the root of the tree.
        line: where it begins, counted from 1.
        what: the change in a line.
        source: the whole file with the change.
    """

    file: str
    line: int
    what: str
    source: str


def mutants_of(file: str, source: str) -> list[Mutant]:
    """Return all mutants of a module, in the order of its lines."""
    found: list[Mutant] = []
    lines = source.splitlines(keepends=True)
    starts = [0]
    for line in lines:
        starts.append(starts[-1] + len(line.encode()))
    data = source.encode()
    for node, changed in _changes(ast.parse(source)):
        assert node.end_lineno is not None
        assert node.end_col_offset is not None
        begin, end = starts[node.lineno - 1] + node.col_offset, starts[node.end_lineno - 1] + node.end_col_offset
        was, put = data[begin:end].decode(), ast.unparse(changed)
        put = f"({put})" if isinstance(node, ast.expr) else put
        text = (data[:begin] + put.encode() + data[end:]).decode()
        if _compiles(text):
            what = f"{' '.join(was.split())} -> {' '.join(ast.unparse(changed).split())}"
            found.append(Mutant(file, node.lineno, what, text))
    return sorted(found, key=lambda each: each.line)


def top_lines(source: str) -> set[int]:
    """Return the lines that are executed as a module is imported: no test reaches them by itself."""
    inside: set[int] = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.FunctionDef):
            assert node.end_lineno is not None
            inside |= set(range(node.body[0].lineno, node.end_lineno + 1))
    return set(range(1, source.count("\n") + 2)) - inside


def kernel_lines(source: str) -> set[int]:
    """Return the lines of compiled loops, which no tracer sees."""
    inside: set[int] = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.FunctionDef) and any("njit" in ast.unparse(each) for each in node.decorator_list):
            assert node.end_lineno is not None
            inside |= set(range(node.lineno, node.end_lineno + 1))
    return inside


def _changes(tree: ast.Module) -> Iterator[tuple[ast.expr | ast.stmt, ast.AST]]:
    """Yield nodes of a module and what stands in their place."""
    pending: list[ast.AST] = [tree]
    while pending:
        node = pending.pop()
        yield from _changed(node)
        pending.extend(_looked_into(node))


def _looked_into(node: ast.AST) -> Iterator[ast.AST]:
    """Yield the parts of a node in which changes count."""
    skipped: list[ast.AST] = []
    if isinstance(node, ast.Import | ast.ImportFrom | ast.Raise | ast.Assert | ast.JoinedStr):
        return
    if isinstance(node, ast.FunctionDef | ast.ClassDef):
        skipped += node.decorator_list
    if isinstance(node, ast.FunctionDef):
        skipped += [] if node.returns is None else [node.returns]
    if isinstance(node, ast.AnnAssign) and not ast.unparse(node.annotation).startswith("Annotated"):
        skipped.append(node.annotation)
    if isinstance(node, ast.arg):
        skipped += [] if node.annotation is None else [node.annotation]
    if isinstance(node, ast.keyword) and node.arg in _SILENT:
        return
    if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
        return
    yield from (each for each in ast.iter_child_nodes(node) if each not in skipped)


def _changed(node: ast.AST) -> Iterator[tuple[ast.expr | ast.stmt, ast.AST]]:
    """Yield the changes of one node itself."""
    if isinstance(node, ast.Compare | ast.BinOp | ast.BoolOp):
        yield from ((node, changed) for changed in _recombined(node))
    elif isinstance(node, ast.UnaryOp) and not isinstance(node.operand, ast.Constant):
        yield node, node.operand
    elif isinstance(node, ast.Constant):
        yield from ((node, ast.Constant(value)) for value in _other_values(node.value))
    elif isinstance(node, ast.Call):
        yield from _called(node)
    elif isinstance(node, ast.AugAssign) and type(node.op) in _COMBINED:
        yield node, _with(node, "op", _COMBINED[type(node.op)]())
        yield node, ast.Pass()
    elif isinstance(node, ast.If) and isinstance(node.body[-1], ast.Return | ast.Raise | ast.Continue | ast.Break):
        yield node.test, ast.Constant(value=False)
    elif isinstance(node, ast.Expr) and isinstance(node.value, ast.Call):
        yield node, ast.Pass()


def _recombined(node: ast.Compare | ast.BinOp | ast.BoolOp) -> Iterator[ast.AST]:
    """Yield what else two operands or more may make together, one of them left out as well."""
    if isinstance(node, ast.Compare):
        for index, operator in enumerate(node.ops):
            for other in _COMPARED[type(operator)]:
                yield _with(node, "ops", [*node.ops[:index], other(), *node.ops[index + 1 :]])
    elif isinstance(node, ast.BoolOp):
        yield _with(node, "op", ast.And() if isinstance(node.op, ast.Or) else ast.Or())
        for index in range(len(node.values)):
            rest = node.values[:index] + node.values[index + 1 :]
            yield rest[0] if len(rest) == 1 else _with(node, "values", rest)
    elif type(node.op) in _COMBINED and not _is_text(node):
        yield _with(node, "op", _COMBINED[type(node.op)]())
        yield node.left
        if isinstance(node.op, ast.Add | ast.Mult):
            yield node.right


def _called(node: ast.Call) -> Iterator[tuple[ast.expr, ast.AST]]:
    """Yield what else might be called."""
    if isinstance(node.func, ast.Name) and node.func.id in _CALLED:
        yield node, _with(node, "func", ast.Name(_CALLED[node.func.id]))
    elif isinstance(node.func, ast.Attribute) and node.func.attr in _CALLED:
        yield node, _with(node, "func", _with(node.func, "attr", _CALLED[node.func.attr]))
    elif ast.unparse(node.func) in {"abs", "np.abs"}:
        yield node, node.args[0]


def _other_values(value: object) -> Iterator[bool | int | float]:
    """Yield what a number or truth value becomes: the next one, twice, half."""
    if isinstance(value, bool):
        yield not value
    elif isinstance(value, int):
        yield value + 1
    elif isinstance(value, float):
        yield from (2.0 * value, 0.5 * value) if value else (1.0,)


def _with(node: ast.AST, field: str, value: object) -> ast.AST:
    changed = copy.copy(node)
    setattr(changed, field, value)
    return changed


def _is_text(node: ast.AST) -> bool:
    """Say whether a sum is one of texts or lists, where a change only breaks it or only looks different."""
    kinds = (ast.JoinedStr, ast.List, ast.Tuple)
    return any(isinstance(each, kinds) or _text(each) for each in ast.walk(node))


def _text(node: ast.AST) -> bool:
    return isinstance(node, ast.Constant) and isinstance(node.value, str)


def _compiles(source: str) -> bool:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            compile(source, "mutant", "exec")
    except (SyntaxError, Warning):
        return False
    return True


_SWAPPED = {
    "<": ">", ">": "<", "<=": "<", ">=": ">", "<>": "=", " AND ": " OR ", " OR ": " AND ", "TRUE": "FALSE",
    "FALSE": "TRUE", "NOT ": "", "\\On": "\\Off", "\\Off": "\\On", "+": "-", "fine": "z1",
}  # fmt: skip
_PLACES = re.compile(r"<>|<=|>=|<(?![A-Z]+>)|(?<![A-Z])>| AND | OR |\bTRUE\b|\bFALSE\b|NOT |\\On\b|\\Off\b|\+|\bfine\b")
_NUMBER = re.compile(r"(?<![\w.])\d+(?![\w.])")
# Lines without which a module cannot be loaded at all: no test needs to find that.
_FRAME = (
    "MODULE", "ENDMODULE", "PROC", "ENDPROC", "FUNC", "ENDFUNC", "IF", "ENDIF", "ELSE", "WHILE", "ENDWHILE",
    "FOR", "ENDFOR", "VAR", "PERS", "CONST", "TEST", "ENDTEST", "CASE", "TRAP", "ENDTRAP", "RECORD", "ENDRECORD",
)  # fmt: skip


def mutants_of_text(file: str, text: str) -> list[Mutant]:
    """Return all mutants of a template, in the order of its lines."""
    lines = text.split("\n")
    found: list[Mutant] = []
    for index, line in enumerate(lines):
        tags, bar, bare = line.rpartition("|") if line.startswith("@") else ("", "", line)
        if not bare.strip() or bare.strip().startswith("!"):
            continue
        for other in _others(bare):
            changed = "\n".join([*lines[:index], *([tags + bar + other] if other else []), *lines[index + 1 :]])
            found.append(Mutant(file, index + 1, f"{bare.strip()} -> {other.strip() or 'nothing'}", changed))
    return found


def _others(line: str) -> Iterator[str]:
    """Yield what may stand in the place of a line; an empty text where it is left out."""
    # What is written on the pendant is for people.
    code = line.split('"')[0]
    if code.strip().rstrip(";").split(" ")[0].split("(")[0] not in _FRAME:
        yield ""
    for match in _PLACES.finditer(code):
        yield line[: match.start()] + _SWAPPED[match[0]] + line[match.end() :]
    for match in _NUMBER.finditer(code):
        yield (
            line[: match.start()]
            + str(1 - int(match[0]) if match[0] in "01" else int(match[0]) + 1)
            + line[match.end() :]
        )
