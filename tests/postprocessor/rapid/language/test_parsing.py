"""The parser reads RAPID as people write it, and refuses the rest by line and reason."""

import re
from dataclasses import replace
from importlib import resources
from time import process_time

import pytest
from hypothesis import given, settings, strategies as st

from geoprint.errors import VerificationError
from geoprint.postprocessor.rapid.language.parsing import parse_module
from geoprint.postprocessor.rapid.language.symbols import examine
from geoprint.postprocessor.rapid.language.syntax import (
    Aggregate,
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
    If,
    Label,
    Leave,
    Literal,
    Module,
    Name,
    Parameter,
    RecordType,
    Series,
    Statement,
    Test as Choice,
    Unary,
)


def in_routine(*lines: str) -> tuple[Statement, ...]:
    """Parse statements; the first stands in line 3."""
    return parsed(*lines).routines[0].body


def parsed(*lines: str) -> Module:
    return parse_module("A.mod", "\n".join(["MODULE A", "PROC p()", *lines, "ENDPROC", "ENDMODULE"]))


def value(text: str) -> Expression:
    (statement,) = in_routine(f"x := {text};")
    assert isinstance(statement, Assignment)
    return statement.value


def test_a_module_is_read_whole() -> None:
    text = (
        "%%%\n  VERSION:1\n  LANGUAGE:ENGLISH\n%%%\n"
        "! about\nMODULE Work(SYSMODULE, NOSTEPIN)\n"
        "  LOCAL RECORD drop num size; pos where; ENDRECORD\n  ALIAS num count;\n"
        '  TASK PERS num gain:=-1.5; local const string name:="a ""b"" \\\\ \\41";\n  VAR num grid{2,3};\n'
        "  FUNC num twice(num x \\ switch loud | VAR num y{*,*}, INOUT bool z)\n    CONST num k:=0x1F; RETURN x*k;\n"
        "  ERROR (ERR_A, ERR_B) RETRY; ERROR TRYNEXT; UNDO Stop; BACKWARD RETURN 1;\n  ENDFUNC\n"
        "  TRAP rung ! bell\n  ENDTRAP\nENDMODULE\n\n\x1a"
    )
    module = parse_module("Work.mod", "\ufeff" + text.replace("\n", "\r\n"))
    assert (module.name, module.attributes, module.comments) == ("Work", ("SYSMODULE", "NOSTEPIN"), ((5, "! about"),))
    assert module.types[0] == RecordType(7, "drop", (("num", "size"), ("pos", "where")), local=True)
    assert module.data[0] == Datum(9, "gain", "PERS", "num", (), Literal(9, -1.5))
    assert module.data[1].value == Literal(9, 'a "b" \\ A')
    assert module.data[1].local
    assert module.data[2].sizes == (Literal(10, 2.0), Literal(10, 3.0))
    function, trap = module.routines
    assert (function.line, function.last_line, function.kind, function.returns) == (11, 14, "FUNC", "num")
    assert function.parameters == (
        Parameter(11, "x", "num", "", optional=False, group=0, dimensions=0),
        Parameter(11, "loud", "switch", "", optional=True, group=1, dimensions=0),
        Parameter(11, "y", "num", "VAR", optional=True, group=1, dimensions=2),
        Parameter(11, "z", "bool", "INOUT", optional=False, group=2, dimensions=0),
    )
    assert function.data == (Datum(12, "k", "CONST", "num", (), Literal(12, 31.0)),)
    assert function.handlers[0].errors == (Name(13, "ERR_A"), Name(13, "ERR_B"))
    assert function.handlers[1].body == (Leave(13, "TRYNEXT", None),)
    assert function.undo == (Call(13, "Stop", None, ()),)
    assert function.backward == (Leave(13, "RETURN", Literal(13, 1.0)),)
    assert (trap.kind, trap.parameters, trap.line, trap.last_line) == ("TRAP", (), 15, 16)


def test_statements_may_share_a_line_or_fill_several() -> None:
    assert in_routine("a:=1;b:=2; TPWrite", '  "x"', "  \\Num:=a;") == (
        Assignment(3, Name(3, "a"), Literal(3, 1.0)),
        Assignment(3, Name(3, "b"), Literal(3, 2.0)),
        Call(
            3,
            "TPWrite",
            None,
            (
                Argument(4, "", Literal(4, "x"), optional=False),
                Argument(5, "Num", Name(5, "a"), optional=True),
            ),
        ),
    )


def test_arguments_come_in_every_form() -> None:
    (call,) = in_routine('%"part"+name% \\On, Size:=3 \\Level?lifted \\Tool:=t;')
    assert isinstance(call, Call)
    assert call.late == Binary(3, "+", Literal(3, "part"), Name(3, "name"))
    assert call.arguments == (
        Argument(3, "On", None, optional=True),
        Argument(3, "Size", Literal(3, 3.0), optional=False),
        Argument(3, "Level", None, optional=True, forwarded="lifted"),
        Argument(3, "Tool", Name(3, "t"), optional=True),
    )


def test_flow_is_read_with_its_bodies() -> None:
    done = (Call(3, "Done", None, ()),)
    branch, compact, choice, loop = in_routine(
        "IF a THEN Done; elseif b THEN Done; ELSE Done; ENDIF IF c GOTO off; "
        "TEST n CASE 1,2: Done; DEFAULT: Done; ENDTEST FOR i FROM 1 TO 9 STEP -2 DO Done; ENDFOR"
    )
    assert branch == If(3, ((Name(3, "a"), done), (Name(3, "b"), done)), done)
    assert compact == If(3, ((Name(3, "c"), (Goto(3, "off"),)),), ())
    assert choice == Choice(3, Name(3, "n"), (((Literal(3, 1.0), Literal(3, 2.0)), done),), done)
    assert loop == For(3, "i", Literal(3, 1.0), Literal(3, 9.0), Literal(3, -2.0), done)
    assert in_routine("off: CONNECT ring{2} WITH bell;") == (
        Label(3, "off"),
        Connect(3, Element(3, Name(3, "ring"), (Literal(3, 2.0),)), "bell"),
    )


@pytest.mark.parametrize("text", ["geo_guard.mod", "geo_stack.mod", "geo_resident.sys"])
def test_what_is_written_has_not_only_where_the_kernels_grammar_has_it(text: str) -> None:
    # <expr> ::= [NOT] <logical term> {(OR | XOR) <logical term>}: elsewhere it stands in parentheses.
    written = resources.files("geoprint.postprocessor.rapid").joinpath(text).read_text(encoding="ascii")
    assert re.findall(r"(?i)\b(?:and|or|xor)\s+not\b", written) == []


def test_operators_bind_as_in_the_kernels_grammar() -> None:
    a, b, c = (Name(3, name) for name in "abc")
    assert value("a OR b AND c") == Binary(3, "OR", a, Binary(3, "AND", b, c))
    assert value("NOT a AND b") == Unary(3, "NOT", Binary(3, "AND", a, b))
    assert value("NOT a OR b") == Binary(3, "OR", Unary(3, "NOT", a), b)
    assert value("a AND NOT b") == Binary(3, "AND", a, Unary(3, "NOT", b))
    assert value("a=b+c*-a") == Binary(3, "=", a, Binary(3, "+", b, Binary(3, "*", c, Unary(3, "-", a))))
    assert value("a-b-c") == Binary(3, "-", Binary(3, "-", a, b), c)
    assert value("(a-b) DIV 2") == Binary(3, "DIV", Binary(3, "-", a, b), Literal(3, 2.0))
    assert value("a{1,b}.x") == Component(3, Element(3, a, (Literal(3, 1.0), b)), "x")


def test_an_aggregate_of_literals_is_one_literal() -> None:
    assert value('[[1,-2.5E-1],[TRUE,"x"],+.5]') == Literal(3, ((1.0, -0.25), (True, "x"), 0.5))
    assert value("[1,a]") == Aggregate(3, (Literal(3, 1.0), Name(3, "a")))
    assert value("[[1,2],[3,9E9]]") == value("[ [1,2] , [ 3 , 9e+09 ] ]")


def test_an_instruction_without_a_semicolon_behind_it_is_refused_where_it_ends() -> None:
    with pytest.raises(VerificationError, match=r"A\.mod, line 3: ; is missing after an argument"):
        parsed("Set doA", "ENDIF")


@pytest.mark.parametrize(
    ("lines", "reason"),
    [
        ("x := 1;\nVAR num y;", r"line 4: VAR declares data after a statement"),
        ("<SMT>", r"line 3: the placeholder <SMT> was never filled in"),
        ('TPWrite "no end;', r"line 3: a text has no closing quotation mark"),
        ("IF a THEN\nx:=1;", r"line 5: ENDIF is missing for the IF of line 3: found ENDPROC"),
        ("x := ;", r"line 3: a value is missing: found ;"),
        ("Foo 1 2;", r"line 3: ; is missing after an argument: found a number"),
        ("GOTO end;\nFOR to FROM 1 TO 2 DO", r"line 4: .* found TO, which is a reserved word"),
        ("ENDPROC\nx:=1;", r"line 4: a declaration or ENDMODULE is missing: found a name 'x'"),
        ("ENDPROC\nPROC q()\nPERS num x:=1;", r"line 5: q declares a PERS"),
        ("x := 1 # 2;", r"line 3: '#' has no meaning"),
        ("ENDPROC\nENDMODULE\nMODULE B\nPROC c()", r"line 5: text follows ENDMODULE"),
    ],
)
def test_what_is_no_rapid_is_refused_by_line_and_reason(lines: str, reason: str) -> None:
    with pytest.raises(VerificationError, match=reason):
        parsed(lines)


def test_an_encoded_module_is_refused_in_words() -> None:
    with pytest.raises(VerificationError, match=r"line 2: module Hidden is encoded"):
        parse_module("H.mod", "MODULE Hidden(NOVIEW)\n 4F 2A 77 :\nENDMODULE\n")
    assert parse_module("H.mod", "MODULE Hidden(NOVIEW)\nVAR num x;\nENDMODULE\n").data


WHOLE = (
    "MODULE A RECORD r num x ; ENDRECORD VAR num y {2} := [1,2] ; PROC p ( num a \\ switch b ) VAR pos c ;\n "
    "x := 1 ;\n MoveL [[1,2,3],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v10,z1,tool0;\n "
    "IF a = 1 AND NOT x THEN Foo \\b , y{1} ; ELSE GOTO off ; ENDIF off : FOR i FROM 1 TO 2 DO c.x := -i ; ENDFOR "
    'TEST a CASE 1 : %"p"% 1 ; ENDTEST ERROR TRYNEXT ; ENDPROC ENDMODULE'
)
WORDS = st.sampled_from(["v1", "z_1", "True", "tool", "RETURN", "x"])
NUMBERS = st.sampled_from(["1", "-0.5", "+3", ".5", "9E9", "2.5e-3", "007", "1.", "-", "a"])
LISTS = st.recursive(NUMBERS, lambda part: st.lists(part, max_size=3).map(lambda parts: f"[{', '.join(parts)}]"))
TAILS = st.lists(
    st.tuples(st.sampled_from([",", "\\T2:=", "\\WObj:=", "\\On", " "]), WORDS).map("".join), max_size=4
).map("".join)
TARGETS = st.sampled_from(
    [
        "[[1,2,3],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]",
        "[[1.5,-2,.3],[1,0,0,0],[0,-1,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]",
        "[[+1,05,3.],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]",
        "[[1-2,2,3],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]",
        "[[1.2.3,2,3],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]",
        "[[1,2,3],[1,0,0,0],[0,0,0,0],[e,9E9,9E9,9E9,9E9,9E9]]",
        "[[1,2],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]",
    ]
)
LINES = st.tuples(
    st.sampled_from(["MoveL", "Foo", "IF", "x:="]), LISTS | TARGETS, TAILS, st.sampled_from([";", "; ! x", ""])
)


def _each_by_itself(module: Module) -> Module:
    """Return a module with each call of its series a statement."""
    routines = [
        replace(routine, body=tuple(one for each in routine.body for one in _calls(each)))
        for routine in module.routines
    ]
    return replace(module, routines=tuple(routines))


def _calls(statement: Statement) -> list[Statement]:
    return list(statement.calls()) if isinstance(statement, Series) else [statement]


def _outcome(text: str, *, whole_calls: bool) -> Module | str:
    try:
        return _each_by_itself(parse_module("A.mod", text, whole_calls=whole_calls))
    except VerificationError as error:
        # The fast way may see a line whole where the slow way stops within it.
        return re.sub(r"found .*", "", str(error))


@settings(max_examples=300, deadline=None)
@given(st.lists(LINES, min_size=1, max_size=4))
def test_instructions_read_whole_are_the_same_as_read_by_token(lines: list[tuple[str, str, str, str]]) -> None:
    text = "\n".join(["MODULE A", "PROC p()", "x:=1;", *(f"{a} {b}{c}{d}" for a, b, c, d in lines), "ENDPROC"])
    text += "\nENDMODULE\n"
    assert _outcome(text, whole_calls=True) == _outcome(text, whole_calls=False)


def test_a_target_of_a_program_is_read_whole() -> None:
    line = "MoveL [[1.5,-2,3],[1,0,0,0],[0,-1,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v1,z1,t\\WObj:=w;"
    text = f"MODULE A\nPROC p()\nx:=1;\n{line}\nENDPROC\nENDMODULE\n"
    fast, slow = (parse_module("A.mod", text, whole_calls=whole) for whole in (True, False))
    assert isinstance(fast.routines[0].body[1], Series)
    assert _each_by_itself(fast) == slow
    (_, move) = slow.routines[0].body
    assert isinstance(move, Call)
    target = move.arguments[0].value
    assert isinstance(target, Literal)
    assert target.value == ((1.5, -2.0, 3.0), (1.0, 0.0, 0.0, 0.0), (0.0, -1.0, 0.0, 0.0), (9e9,) * 6)
    assert move.arguments[4] == Argument(4, "WObj", Name(4, "w"), optional=True)


def test_functions_know_their_arguments() -> None:
    assert value("Offs(p1, 1, 2 \\X, Z:=3)") == FunctionCall(
        3,
        "Offs",
        (
            Argument(3, "", Name(3, "p1"), optional=False),
            Argument(3, "", Literal(3, 1.0), optional=False),
            Argument(3, "", Literal(3, 2.0), optional=False),
            Argument(3, "X", None, optional=True),
            Argument(3, "Z", Literal(3, 3.0), optional=False),
        ),
    )


@pytest.mark.parametrize(
    "line",
    [
        f"x:={'(' * 3000}1{')' * 3000};",
        f"x:={'[' * 3000}1{']' * 3000};",
        f"x:={'-' * 5000}x;",
        f"{'IF a THEN ' * 2000}{'ENDIF ' * 2000}",
    ],
    ids=["brackets", "aggregates", "signs", "branches"],
)
def test_what_stands_too_deep_is_refused_by_its_line(line: str) -> None:
    with pytest.raises(VerificationError, match=r"line 3: statements or brackets are nested too deeply"):
        parsed(line)


@pytest.mark.parametrize(
    ("row", "said"), [("1" + "+1" * 5000, "x is not declared"), ("a" + " AND a" * 5000, "too deeply")]
)
def test_a_long_sum_is_judged_and_a_long_row_of_conditions_refused(row: str, said: str) -> None:
    assert said in str(examine([parsed(f"x:={row};")], signals=None)[1][0])


def test_the_time_of_a_line_grows_with_its_length_and_not_with_its_square() -> None:
    began = process_time()
    call = in_routine(f"go {'[1],' * 60_000}1;")[0]
    assert isinstance(call, Call)
    assert [each.value for each in call.arguments[:2]] == [Literal(3, (1.0,))] * 2
    # Read anew from each bracket on it takes half a minute.
    assert process_time() - began < 8.0


@settings(max_examples=200, deadline=None)
@given(st.data())
def test_whatever_the_text_it_is_a_module_or_refused_by_a_line(data: st.DataObject) -> None:
    words: list[str] = list[str](WHOLE.split(" "))
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, len(words) - 1))
        words[at : at + data.draw(st.integers(0, 2))] = data.draw(
            st.lists(st.sampled_from([*words, *'()[]{}\\%?;:,."!<>=+', "0x", "<SMT>", "9E9"]), max_size=2)
        )
    outcomes = [_outcome(" ".join(words), whole_calls=whole) for whole in (True, False)]
    assert outcomes[0] == outcomes[1]
    if isinstance(outcomes[0], Module):
        examine([outcomes[0]], signals=None)
