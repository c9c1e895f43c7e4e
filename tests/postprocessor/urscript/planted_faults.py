"""Faults in a written URScript program, each of which `geoprint check` must find.

The program is that of a plate of two runs with lags and a vacuum; a fault is a change of its text.
Some change only what no scenario brings: the form of the script alone shows them.
"""

from __future__ import annotations

import re
from collections.abc import Callable

Fault = tuple[str, Callable[[str], str]]
NUMBER = r"-?\d+\.\d+"


def swap(old: str, new: str, count: int = 1) -> Callable[[str], str]:
    return lambda text: text.replace(old, new, count)


def edit(pattern: str, new: str | Callable[[re.Match[str]], str], number: int = 0) -> Callable[[str], str]:
    """Replace one of the matches of a pattern."""

    def edited(text: str) -> str:
        match = list(re.finditer(pattern, text, re.MULTILINE))[number]
        by = match.expand(new) if isinstance(new, str) else new(match)
        return text[: match.start()] + by + text[match.end() :]

    return edited


def moved(by: float, column: int, *, number: int, before: str = r"movep\(pose_trans\(geo_at, ") -> Callable[[str], str]:
    """Change a number of the pose of one line [m, rad]."""

    def new(match: re.Match[str]) -> str:
        numbers = match[2].split(",")
        numbers[column] = f"{float(numbers[column]) + by:.7f}"
        return f"{match[1]}{','.join(numbers)}]"

    return edit(rf"({before}p\[)([^\]]*)\]", new, number)


def scaled(by: float, word: str, number: int) -> Callable[[str], str]:
    """Multiply a number behind a word."""
    return edit(rf"({re.escape(word)})(\d+\.?\d*)", lambda match: f"{match[1]}{by * float(match[2]):.7f}", number)


def without(pattern: str, number: int = 0) -> Callable[[str], str]:
    return edit(rf"{pattern}\n", "", number)


MOVE = r" +global geo_step = \d+\n +movep\(.*"
WAIT = r"geo_wait\(\d+, "
# A value that is 0 in a dry run of a new program and in a print, and at no other speed.
HIDDEN = "(geo_speed_pct - 25) * (geo_speed_pct - 100) * 0.001"
SWITCHES = "    if geo_speed_pct == 50:\n      set_standard_digital_out(0, True)\n    end\n"
FUNCTION = f"  def other(k):\n{SWITCHES}    return k\n  end\n"


def before_begin(lines: str) -> Callable[[str], str]:
    return swap("\n  geo_begin()\n", f"\n{lines}  geo_begin()\n")


def behind_move(lines: str) -> Callable[[str], str]:
    """Add lines where the arm may wait behind a move."""
    return edit(r"( +global geo_step = (\d+)\n +movep\(.* r=0\)\n)", rf"\1    global geo_step = \2.5\n{lines}", 1)


FAULTS: tuple[Fault, ...] = (
    # Targets.
    ("a target 0.01 mm aside", moved(1e-5, 0, number=12)),
    ("a target 0.002 mm higher", moved(2e-6, 2, number=5)),
    ("the last target 0.01 mm aside", moved(1e-5, 1, number=-1)),
    ("the first target 0.01 mm aside", moved(1e-5, 0, number=0, before="geo_first = ")),
    ("a tool turned by 0.1 mrad", moved(1e-4, 3, number=8)),
    ("a target in metres of another sign", moved(-2e-3, 1, number=20)),
    ("a move left out", without(MOVE, 9)),
    ("a move made twice", edit(rf"({MOVE}\n)", r"\1\1", 9)),
    ("two moves in each other's place", edit(rf"({MOVE}\n)({MOVE}\n)", r"\2\1", 6)),
    ("a run left out", without(r"  geo_run_2\(\)")),
    ("a run printed twice", swap("  geo_run_2()\n", "  geo_run_2()\n  geo_run_2()\n")),
    ("runs in each other's place", swap("  geo_run_1()\n  geo_run_2()\n", "  geo_run_2()\n  geo_run_1()\n")),
    ("a straight move of another kind", edit(r"movep\((.*), a=(.*), v=(.*), r=0\)", r"movel(\1, a=\2, v=\3, r=0)", 0)),
    ("a move that is not in the work object", edit(r"movep\(pose_trans\(geo_at, (p\[.*?\])\)", r"movep(\1", 15)),
    ("a move in the lifted frame", edit(r"movep\(pose_trans\(geo_at", "movep(pose_trans(geo_lifted", 15)),
    # Speeds and blends.
    ("a speed 2 % higher", scaled(1.02, "v=geo_rate * ", 10)),
    ("a speed 0.1 % lower", scaled(0.999, "v=geo_rate * ", 10)),
    ("a speed that no setting slows down", edit(r"v=geo_rate \* ", "v=", 10)),
    ("another acceleration", scaled(2.0, " a=", 3)),
    ("a larger blend", scaled(1.1, " r=", 7)),
    ("a smaller blend", scaled(0.9, " r=", 7)),
    ("a blend at a stop", edit(r"r=0\)", "r=0.0001)", 1)),
    ("a stop on the path", edit(r"r=0\.\d+\)", "r=0)", 4)),
    ("blends that overlap", edit(r"r=0\.\d+\)", "r=0.01)", 4)),
    ("a rest on the path", edit(rf"({MOVE}\n)", r"\1    sleep(0.05)\n", 2)),
    # Outputs.
    ("a valve that never opens", edit(r" +geo_wait\(.*\n +geo_valve\(True\)\n", "", 0)),
    ("a valve that stays open", edit(r" +geo_wait\(.*\n +geo_valve\(False\)\n", "", 0)),
    ("a valve that opens where it must shut", edit(r"geo_valve\(False\)", "geo_valve(True)", 0)),
    ("outputs in each other's place", edit(r"geo_valve\(True\)", "geo_lamp(True)", 0)),
    ("a switching 3 ms early", moved(-6e-5, 0, number=3, before=WAIT)),
    ("a switching 0.01 mm beside its place", moved(1e-5, 0, number=3, before=WAIT)),
    ("a plane that faces backwards", moved(3.1415927, 4, number=3, before=WAIT)),
    ("a switching in the move before", edit(r"geo_wait\((\d\d), ", lambda match: f"geo_wait({int(match[1]) - 1}, ", 0)),
    ("a switching that waits for nothing", edit(r"geo_wait\(\d+, ", "geo_wait(0, ", 2)),
    ("a counter that is late", edit(r"global geo_step = 4\n", "global geo_step = 3\n", 0)),
    ("a counter that is not global", edit(r"global geo_step = 4\n", "geo_step = 4\n", 0)),
    ("a thread that is not started", without(r"    local switching = run geo_switch_1\(\)")),
    ("a thread that nobody waits for", without(r"    join switching", 1)),
    ("a thread of another run", swap("run geo_switch_2()", "run geo_switch_1()")),
    ("a thread without sync", without(r"      sync\(\)")),
    ("another output of the controller", edit(r"set_standard_digital_out\(0, on", "set_standard_digital_out(2, on", 0)),
    ("an output that the path switches itself", edit(MOVE, r"\g<0>\n    set_standard_digital_out(0, True)", 3)),
    ("an output that stays high at a stop", without(r"    set_runstate_standard_digital_output_to_value\(0, 1\)")),
    ("an output that goes high at a stop", edit(r"output_to_value\(1, 1\)", "output_to_value(1, 2)", 0)),
    # What stands around the path.
    ("a tool 0.01 mm longer", moved(1e-5, 2, number=0, before="geo_tcp = ")),
    ("another load", edit(r"geo_mass = 0\.6", "geo_mass = 0.7", 0)),
    ("a work object 0.01 mm aside", moved(1e-5, 0, number=0, before="geo_part = ")),
    ("another home", edit(rf"geo_home = \[({NUMBER})", "geo_home = [-0.2", 0)),
    ("a new program that prints", swap("geo_dry_run = True", "geo_dry_run = False")),
    ("a question that is not asked", edit(r" +popup\(\"It PRINTS.*\n", "", 0)),
    # What depends on a setting, at a value that no scenario has.
    ("an output that a speed switches", behind_move(SWITCHES)),
    (
        "a move that a speed makes",
        behind_move(SWITCHES.replace("set_standard_digital_out(0, True)", "movel(geo_work)")),
    ),
    ("a wait of another form", behind_move("    if geo_on:\n      sleep(0)\n    else:\n      sleep(0)\n    end\n")),
    ("a wait for a speed", behind_move("    if geo_on and geo_speed_pct == 50:\n      sleep(9)\n    end\n")),
    ("a wait that a speed sets", behind_move(f"    if geo_on:\n      sleep({HIDDEN})\n    end\n")),
    ("a home that a speed moves", edit(r"(geo_home = \[-\d\.\d+)", rf"\1 + {HIDDEN}")),
    ("a target that a speed moves", edit(rf"(pose_trans\(geo_at, p\[{NUMBER})", rf"\1 + {HIDDEN}", 7)),
    ("a speed that is added to", edit(r"(v=geo_rate \* 0\.\d+)", rf"\1 + {HIDDEN}", 5)),
    ("a speed by a setting", edit(r"v=geo_rate \*", "v=geo_speed_pct * 0.01 *", 5)),
    ("an acceleration that a speed sets", edit(r" a=(\d\.\d+),", rf" a=\1 + {HIDDEN},", 5)),
    ("a blend that a speed sets", edit(r" r=(0\.\d+)", rf" r=\1 + {HIDDEN}", 5)),
    ("a counter that a speed sets", edit(r"(geo_step = 7)", rf"\1 + {HIDDEN}")),
    ("a place that a speed moves", edit(rf"(geo_wait\(\d+, p\[{NUMBER})", rf"\1 + {HIDDEN}", 2)),
    ("a valve that a speed opens", edit(r"geo_valve\(False\)", "geo_valve(geo_speed_pct == 50)")),
    (
        "a wait by a function",
        lambda text: before_begin(FUNCTION)(edit(r"geo_wait\((\d+),", r"geo_wait(other(\1),")(text)),
    ),
    ("a value by a function", before_begin(f"{FUNCTION}  global value = other(1)\n")),
    ("a function that nobody calls", before_begin(FUNCTION)),
    ("a thread that nobody starts", before_begin("  thread geo_switch_3():\n    sync()\n  end\n")),
    ("a function within a run", edit(r"(    geo_enter\(1\)\n)", r"\1    def other():\n      sync()\n    end\n")),
    (
        "a lifted frame that a speed sinks",
        before_begin(f"  global geo_lifted = pose_trans(p[0, 0, 0.02 + {HIDDEN}, 0, 0, 0], geo_work)\n"),
    ),
    ("a print that is not asked for", before_begin("  global geo_prints = not geo_dry_run\n")),
    ("a print at a speed", before_begin("  global geo_prints = geo_speed_pct == 50\n")),
    ("data that are set again", before_begin("  global geo_back = 0.1 + geo_back - 0.1\n")),
    ("a name that nobody knows", before_begin("  global other = 1\n")),
    ("a sum for a number", edit(r"geo_runs = 2", "geo_runs = 1 + 1")),
    ("an argument of the program", swap("def geoprint():", "def geoprint(geo_on):")),
    ("a statement behind a carriage return", before_begin("  # A comment.\r  set_standard_digital_out(0, True)\n")),
    # Expressions and blocks without end.
    ("3000 brackets", before_begin(f"  global other = {'(' * 3000}1{')' * 3000}\n")),
    ("3000 signs", before_begin(f"  global other = {'-' * 3000}1\n")),
    ("3000 negations", before_begin(f"  global other = {'not ' * 3000}True\n")),
    ("3000 sums", before_begin(f"  global other = 1{' + 1' * 3000}\n")),
    ("3000 items", before_begin(f"  global other = geo_home{'[0]' * 3000}\n")),
    ("3000 branches", before_begin("  if geo_on:\n" * 3000 + "  end\n" * 3000)),
    ("3000 alternatives", before_begin("  if geo_on:\n" + "  elif geo_on:\n" * 3000 + "  end\n")),
)
