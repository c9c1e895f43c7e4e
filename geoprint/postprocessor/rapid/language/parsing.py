"""Parses RAPID as people write it: modules, data, routines, statements and expressions."""

from __future__ import annotations

import gc
import re
from collections.abc import Generator
from contextlib import contextmanager
from typing import cast

from geoprint.postprocessor.rapid.language.syntax import (
    Aggregate,
    Alias,
    Argument,
    Assignment,
    Binary,
    Call,
    Component,
    Connect,
    Datum,
    Element,
    Expression,
    For,
    FunctionCall,
    Goto,
    Handler,
    If,
    Label,
    Leave,
    Literal,
    Module,
    Name,
    Parameter,
    Place,
    RecordType,
    Reference,
    Routine,
    RoutineKind,
    Statement,
    Storage,
    Test,
    Unary,
    Value,
    While,
    refusal,
)
from geoprint.postprocessor.rapid.language.tokens import TOO_DEEP, Cursor

# Leaves the garbage collector alone while a program's text is taken to pieces.
#
# Syntax and compiled steps of a long program are millions of small objects that all live to the end: looking through
# them again and again as they grow finds nothing, and takes half of the time.


@contextmanager
def uncollected() -> Generator[None]:
    """Collect no cycles until the block is left; what it was set to before holds again then, also after an error."""
    was = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was:
            gc.enable()


# Parses RAPID expressions and arguments.
#
# From weakest to strongest: OR and XOR; NOT and AND; comparisons; + and -; * / DIV MOD; sign. `NOT a AND b` denies
# both, as in the kernel's grammar, where NOT stands before a term of ANDs; behind AND it denies what is compared
# next.


_OR = frozenset({"OR", "XOR"})
_COMPARISONS = frozenset({"=", "<>", "<", ">", "<=", ">="})
# Operands of one sum or product; whoever writes more can split it.
_MOST_OPERANDS = 20_000
_SUMS = frozenset({"+", "-"})
_PRODUCTS = frozenset({"*", "/", "DIV", "MOD"})
_LITERALS = frozenset({"number", "string", "numbers"})
_TRUTHS = frozenset({"TRUE", "FALSE"})
_GOES_ON = frozenset({"(", ".", "{"})


def expression(cursor: Cursor) -> Expression:
    """Parse an expression.

    Raises:
        VerificationError: there is none.
    """
    left = _term(cursor)
    while cursor.kind in _OR:
        line, operator = cursor.line, cursor.kind
        cursor.step()
        left = Binary(line, operator, left, _term(cursor))
    return left


def arguments(cursor: Cursor, closing: str) -> tuple[Argument, ...]:
    """Parse the arguments of a call up to what closes them, which is left standing.

    Raises:
        VerificationError: they are not RAPID.
    """
    found: list[Argument] = []
    cursor.take(",")
    while cursor.kind != closing:
        if found and not cursor.take(",") and cursor.kind != "\\":
            cursor.need(closing, "an argument")
        found.append(_option(cursor) if cursor.kind == "\\" else _required(cursor))
    return tuple(found)


def expressions(cursor: Cursor, closing: str) -> tuple[Expression, ...]:
    """Parse one or more expressions with commas between them, and step over what closes them.

    Raises:
        VerificationError: they are not RAPID.
    """
    found = [expression(cursor)]
    while cursor.take(","):
        found.append(expression(cursor))
    cursor.need(closing, "an expression")
    return tuple(found)


def reference(cursor: Cursor, name: str, line: int) -> Expression:
    """Parse what follows a name: components and elements."""
    found: Expression = Name(line, name)
    while cursor.kind in {".", "{"}:
        at = cursor.line
        if cursor.take("."):
            found = Component(at, found, cursor.name("a component"))
        else:
            cursor.step()
            found = Element(at, found, expressions(cursor, "}"))
    return found


def _required(cursor: Cursor) -> Argument:
    line = cursor.line
    value = expression(cursor)
    if isinstance(value, Name) and cursor.take(":="):
        return Argument(line, value.name, expression(cursor), optional=False)
    return Argument(line, "", value, optional=False)


def _option(cursor: Cursor) -> Argument:
    line = cursor.line
    cursor.step()
    name = cursor.name("an optional argument")
    if cursor.take(":="):
        return Argument(line, name, expression(cursor), optional=True)
    if cursor.take("?"):
        return Argument(line, name, None, optional=True, forwarded=cursor.name("an optional parameter"))
    return Argument(line, name, None, optional=True)


def _term(cursor: Cursor) -> Expression:
    line = cursor.line
    if cursor.take("NOT"):
        return Unary(line, "NOT", _term(cursor))
    left = _comparison(cursor)
    while cursor.kind == "AND":
        line = cursor.line
        cursor.step()
        left = Binary(line, "AND", left, _comparison(cursor))
    return left


def _comparison(cursor: Cursor) -> Expression:
    line = cursor.line
    if cursor.take("NOT"):
        return Unary(line, "NOT", _comparison(cursor))
    left = _sum(cursor)
    if cursor.kind in _COMPARISONS:
        line, operator = cursor.line, cursor.kind
        cursor.step()
        return Binary(line, operator, left, _sum(cursor))
    return left


def _sum(cursor: Cursor) -> Expression:
    left, count = _product(cursor), 0
    while cursor.kind in _SUMS:
        line, operator, count = cursor.line, cursor.kind, count + 1
        if count > _MOST_OPERANDS:
            cursor.refuse(f"more than {_MOST_OPERANDS} operands are in one sum or product")
        cursor.step()
        left = Binary(line, operator, left, _product(cursor))
    return left


def _product(cursor: Cursor) -> Expression:
    # Most operands have no sign.
    left, count = _primary(cursor) if cursor.kind == "name" else _signed(cursor), 0
    while cursor.kind in _PRODUCTS:
        line, operator, count = cursor.line, cursor.kind, count + 1
        if count > _MOST_OPERANDS:
            cursor.refuse(f"more than {_MOST_OPERANDS} operands are in one sum or product")
        cursor.step()
        left = Binary(line, operator, left, _signed(cursor))
    return left


def _signed(cursor: Cursor) -> Expression:
    if cursor.kind not in _SUMS:
        return _primary(cursor)
    line, operator = cursor.line, cursor.kind
    cursor.step()
    operand = _signed(cursor)
    if isinstance(operand, Literal) and isinstance(operand.value, float):
        return Literal(line, -operand.value if operator == "-" else operand.value)
    return Unary(line, operator, operand)


def _primary(cursor: Cursor) -> Expression:
    line = cursor.line
    if cursor.kind == "name":
        return _of_name(cursor, line)
    if cursor.kind in _LITERALS:
        return Literal(line, cursor.value())
    if cursor.kind in _TRUTHS:
        truth = cursor.kind == "TRUE"
        cursor.step()
        return Literal(line, truth)
    if cursor.take("["):
        return _aggregate(line, () if cursor.take("]") else expressions(cursor, "]"))
    if not cursor.take("("):
        cursor.refuse(f"a value is missing: found {cursor.shown()}")
    inner = expression(cursor)
    cursor.need(")", "an expression")
    return inner


def _of_name(cursor: Cursor, line: int) -> Expression:
    name = cursor.name("a datum")
    # Most names are alone.
    if cursor.kind not in _GOES_ON:
        return Name(line, name)
    if not cursor.take("("):
        return reference(cursor, name, line)
    found = arguments(cursor, ")")
    cursor.step()
    return FunctionCall(line, name, found)


def _aggregate(line: int, parts: tuple[Expression, ...]) -> Expression:
    values: list[Value] = [part.value for part in parts if isinstance(part, Literal)]
    return Literal(line, tuple(values)) if len(values) == len(parts) else Aggregate(line, parts)


# Parses RAPID statements: assignments, calls, branches, loops and what leaves a routine.


# What ends a body of statements.
_ENDS = frozenset(
    {"ENDPROC", "ENDFUNC", "ENDTRAP", "ENDMODULE", "ENDIF", "ENDFOR", "ENDWHILE", "ENDTEST", "end"}
    | {"ELSE", "ELSEIF", "CASE", "DEFAULT", "ERROR", "UNDO", "BACKWARD"}
)
_LEAVING = frozenset({"RETURN", "EXIT", "RETRY", "TRYNEXT", "RAISE"})
# These may bring a value.
_BRINGING = frozenset({"RETURN", "RAISE"})


def body(cursor: Cursor) -> tuple[Statement, ...]:
    """Parse statements up to a word that ends a body, which is left standing.

    Raises:
        VerificationError: they are not RAPID.
    """
    found: list[Statement] = []
    while cursor.kind not in _ENDS:
        found.append(cursor.call() if cursor.kind == "call" else statement(cursor))
    return tuple(found)


def statement(cursor: Cursor) -> Statement:
    """Parse one statement.

    Raises:
        VerificationError: there is none.
    """
    line, kind = cursor.line, cursor.kind
    if kind == "call":
        return cursor.call()
    if kind == "name":
        return _named(cursor)
    if kind in {"VAR", "PERS", "CONST"}:
        cursor.refuse(f"{kind} declares data after a statement; RAPID needs a routine's data first")
    if kind in {"IF", "TEST", "FOR", "WHILE"}:
        cursor.step()
        return {"IF": _if, "TEST": _test, "FOR": _for, "WHILE": _while}[kind](cursor, line)
    found: Statement
    if kind in _LEAVING:
        cursor.step()
        value = expression(cursor) if kind in _BRINGING and cursor.kind != ";" else None
        found = Leave(line, kind, value)  # pyright: ignore[reportArgumentType]
    elif cursor.take("GOTO"):
        found = Goto(line, cursor.name("a label"))
    elif cursor.take("CONNECT"):
        target = _reference(cursor)
        cursor.need("WITH", "the interrupt of CONNECT")
        found = Connect(line, target, cursor.name("a trap"))
    elif cursor.take("%"):
        late = expression(cursor)
        cursor.need("%", "the name of a late-bound call")
        found = Call(line, "", late, arguments(cursor, ";"))
    else:
        cursor.refuse(f"{cursor.shown()} cannot begin a statement")
    cursor.need(";", kind)
    return found


def _named(cursor: Cursor) -> Statement:
    """Parse what begins with a name: a label, an assignment or a call."""
    line = cursor.line
    name = cursor.name("a routine")
    if cursor.take(":"):
        return Label(line, name)
    found: Statement
    if cursor.kind in {":=", ".", "{"}:
        target = cast("Reference", reference(cursor, name, line))
        cursor.need(":=", name)
        found = Assignment(line, target, expression(cursor))
    else:
        found = Call(line, name, None, arguments(cursor, ";"))
    cursor.need(";", name)
    return found


def _reference(cursor: Cursor) -> Reference:
    line = cursor.line
    return cast("Reference", reference(cursor, cursor.name("a datum"), line))


def _if(cursor: Cursor, line: int) -> If:
    condition = expression(cursor)
    if not cursor.take("THEN"):
        return If(line, ((condition, (statement(cursor),)),), ())
    branches: list[tuple[Expression, tuple[Statement, ...]]] = [(condition, body(cursor))]
    while cursor.take("ELSEIF"):
        condition = expression(cursor)
        cursor.need("THEN", "the condition of ELSEIF")
        branches.append((condition, body(cursor)))
    otherwise = body(cursor) if cursor.take("ELSE") else ()
    _close(cursor, "ENDIF", f"IF of line {line}")
    return If(line, tuple(branches), otherwise)


def _test(cursor: Cursor, line: int) -> Test:
    subject = expression(cursor)
    cases: list[tuple[tuple[Expression, ...], tuple[Statement, ...]]] = []
    while cursor.take("CASE"):
        values = expressions(cursor, ":")
        cases.append((values, body(cursor)))
    default: tuple[Statement, ...] = ()
    if cursor.take("DEFAULT"):
        cursor.need(":", "DEFAULT")
        default = body(cursor)
    _close(cursor, "ENDTEST", f"TEST of line {line}")
    return Test(line, subject, tuple(cases), default)


def _for(cursor: Cursor, line: int) -> For:
    variable = cursor.name("a loop's variable")
    cursor.need("FROM", "the variable of FOR")
    first = expression(cursor)
    cursor.need("TO", "the first value of FOR")
    last = expression(cursor)
    step = expression(cursor) if cursor.take("STEP") else None
    cursor.need("DO", "the last value of FOR")
    inner = body(cursor)
    _close(cursor, "ENDFOR", f"FOR of line {line}")
    return For(line, variable, first, last, step, inner)


def _while(cursor: Cursor, line: int) -> While:
    condition = expression(cursor)
    cursor.need("DO", "the condition of WHILE")
    inner = body(cursor)
    _close(cursor, "ENDWHILE", f"WHILE of line {line}")
    return While(line, condition, inner)


def _close(cursor: Cursor, word: str, opened: str) -> None:
    if not cursor.take(word):
        cursor.refuse(f"{word} is missing for the {opened}: found {cursor.shown()}")


# Parses a RAPID module as people write it: its head, types, data and routines.
#
# Case, line ends, layout and comments are free; what an editor or a controller puts before the module (`%%%` with
# version and language, a byte order mark) is stepped over. A module whose text is encoded (NOVIEW) is refused in
# words.


_HEADER = re.compile(r"\A\s*%%%.*?%%%", re.DOTALL)
_ATTRIBUTES = frozenset({"SYSMODULE", "NOVIEW", "NOSTEPIN", "VIEWONLY", "READONLY"})
_STORAGES = frozenset({"VAR", "PERS", "CONST"})
_ROUTINES = frozenset({"PROC", "FUNC", "TRAP"})
_TYPES = frozenset({"RECORD", "ALIAS"})
_DECLARATIONS = _STORAGES | _ROUTINES | _TYPES | {"LOCAL", "TASK", "ENDMODULE"}


def parse_module(file: str, text: str, *, whole_calls: bool = True) -> Module:
    """Parse the text of one module.

    Args:
        file: its name, for errors.
        text: the text.
        whole_calls: whether instructions behind an aggregate of numbers are read in one piece; the same module, faster.

    Raises:
        VerificationError: it is not RAPID; line and reason are named.
    """
    text = text.removeprefix("\ufeff").replace("\r\n", "\n").replace("\r", "\n").rstrip("\x1a\0\n\t ")
    text = _HEADER.sub(lambda header: "\n" * header[0].count("\n"), text, count=1) if _HEADER.match(text) else text
    lines = text.split("\n")
    cursor = Cursor(file, lines, whole_calls=whole_calls)
    try:
        return _module(file, cursor, lines=len(lines))
    except RecursionError as error:
        raise refusal(Place(file, cursor.line), TOO_DEEP) from error


def _module(file: str, cursor: Cursor, *, lines: int) -> Module:
    cursor.need("MODULE", "the start of the file")
    name = cursor.name("a module")
    attributes = _attributes(cursor)
    if "NOVIEW" in attributes and cursor.kind not in _DECLARATIONS:
        cursor.refuse(f"module {name} is encoded (NOVIEW) and cannot be read")
    types: list[RecordType | Alias] = []
    data: list[Datum] = []
    routines: list[Routine] = []
    while cursor.kind != "ENDMODULE":
        local = cursor.take("LOCAL")
        cursor.take("TASK")
        if cursor.kind in _STORAGES:
            data.append(_datum(cursor, local=local))
        elif cursor.kind in _ROUTINES:
            routines.append(_routine(cursor, local=local))
        elif cursor.kind in _TYPES:
            types.append(_type(cursor, local=local))
        else:
            cursor.refuse(f"a declaration or ENDMODULE is missing: found {cursor.shown()}")
    cursor.step()
    if not cursor.ended:
        cursor.refuse(f"text follows ENDMODULE: found {cursor.shown()}")
    return Module(file, name, attributes, tuple(types), tuple(data), tuple(routines), tuple(cursor.comments), lines)


def _attributes(cursor: Cursor) -> tuple[str, ...]:
    found: list[str] = []
    if cursor.take("("):
        while not found or cursor.take(","):
            if cursor.kind not in _ATTRIBUTES:
                cursor.refuse(f"{cursor.shown()} is not an attribute of a module")
            found.append(cursor.kind)
            cursor.step()
        cursor.need(")", "the attributes of a module")
    return tuple(found)


def _type(cursor: Cursor, *, local: bool) -> RecordType | Alias:
    line = cursor.line
    if cursor.take("ALIAS"):
        of = cursor.name("a type")
        alias = Alias(line, cursor.name("a type"), of, local)
        cursor.need(";", "ALIAS")
        return alias
    cursor.step()
    name = cursor.name("a record")
    components: list[tuple[str, str]] = []
    while not cursor.take("ENDRECORD"):
        kind = cursor.name("a component's type")
        components.append((kind, cursor.name("a component")))
        cursor.need(";", "a component")
    return RecordType(line, name, tuple(components), local)


def _datum(cursor: Cursor, *, local: bool) -> Datum:
    line = cursor.line
    storage = cast("Storage", cursor.kind)
    cursor.step()
    kind = cursor.name("a type")
    name = cursor.name("a datum")
    sizes: tuple[Expression, ...] = ()
    if cursor.take("{"):
        sizes = expressions(cursor, "}")
    value = expression(cursor) if cursor.take(":=") else None
    cursor.need(";", name)
    return Datum(line, name, storage, kind, sizes, value, local)


def _routine(cursor: Cursor, *, local: bool) -> Routine:
    line = cursor.line
    kind = cast("RoutineKind", cursor.kind)
    cursor.step()
    returns = cursor.name("a type") if kind == "FUNC" else ""
    name = cursor.name("a routine")
    parameters = _parameters(cursor) if cursor.take("(") else ()
    data: list[Datum] = []
    while cursor.kind in _STORAGES:
        if cursor.kind == "PERS":
            cursor.refuse(f"{name} declares a PERS; only a module can")
        data.append(_datum(cursor, local=False))
    statements = body(cursor)
    clauses: dict[str, tuple[Statement, ...]] = {}
    handlers: list[Handler] = []
    while cursor.kind in {"ERROR", "UNDO", "BACKWARD"}:
        clause, at = cursor.kind, cursor.line
        cursor.step()
        if clause == "ERROR":
            errors = expressions(cursor, ")") if cursor.take("(") else ()
            handlers.append(Handler(at, errors, body(cursor)))
        elif clause in clauses:
            cursor.refuse(f"{name} has a second {clause}")
        else:
            clauses[clause] = body(cursor)
    last = cursor.line
    if not cursor.take(f"END{kind}"):
        cursor.refuse(f"END{kind} is missing for {kind} {name} of line {line}: found {cursor.shown()}")
    undo, backward = clauses.get("UNDO", ()), clauses.get("BACKWARD", ())
    return Routine(
        line, last, name, kind, returns, parameters, tuple(data), statements, tuple(handlers), undo, backward, local
    )


def _parameters(cursor: Cursor) -> tuple[Parameter, ...]:
    """Parse the parameters of a routine and step over the bracket behind them."""
    found: list[Parameter] = []
    group = -1
    optional = False
    while not cursor.take(")"):
        if cursor.take("|"):
            # Without a backslash of its own it is as optional as the one before.
            optional = cursor.take("\\") or optional
        else:
            if found and not cursor.take(",") and cursor.kind != "\\":
                cursor.refuse(f"a comma is missing between parameters: found {cursor.shown()}")
            optional = cursor.take("\\")
            group += 1
        found.append(_parameter(cursor, group=group, optional=optional))
    return tuple(found)


def _parameter(cursor: Cursor, *, group: int, optional: bool) -> Parameter:
    line = cursor.line
    mode = cursor.kind if cursor.kind in {"VAR", "PERS", "INOUT"} else ""
    if mode:
        cursor.step()
    kind = cursor.name("a parameter's type")
    name = cursor.name("a parameter")
    dimensions = 0
    if cursor.take("{"):
        dimensions = 1
        cursor.need("*", "the bracket of an array")
        while cursor.take(","):
            cursor.need("*", "a comma")
            dimensions += 1
        cursor.need("}", "the dimensions of an array")
    return Parameter(line, name, kind, mode, optional, group, dimensions)
