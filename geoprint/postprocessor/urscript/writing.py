"""Writes URScript: a file with what a person sets, the cell, the guard, and for each run a function and a thread.

UR arms are calibrated one by one, so targets are poses that the controller solves: `movep` along the path, and the
joint move to the first target by `get_inverse_kin` near the planned joints. Home alone is joints: those that the
pendant shows. A movep keeps the tool's speed [URScript, Module motion]; its blend is that of the plan, and less than
half of the way to each neighbour, because blends must not overlap [URManual].

Outputs switch by a thread for each run. It goes through its switchings in their order: each waits until the path has
come to the move that carries it (`geo_step`, which the run counts) and has passed its plane. So a tool that comes by
the same place twice switches at the right time. The counter says `k` while target k is approached, and half more while
the arm waits there.
"""

from __future__ import annotations

from collections.abc import Sequence
from importlib.metadata import version
from itertools import pairwise

import numpy as np
from scipy.spatial.transform import Rotation

from geoprint.errors import UsageError
from geoprint.model import Cell, FloatArray, Placement, Process, Program, Tool, printing_steps
from geoprint.postprocessor.interface import RobotProgram
from geoprint.postprocessor.orders import Event, Orders
from geoprint.postprocessor.switching import waits
from geoprint.postprocessor.urscript.guard import guard_lines

FILE = "geoprint.script"
# Longer files take long to load; controllers of the CB series were seen to fail at far shorter ones.
MOST_LINES = 100_000
# Acceleration of the tool along the path, the default of movep, and the most in a ramp [mm/s2].
_ACCELERATION, _MOST = 1200.0, 10000.0
# A move from a rest keeps this share of its time at least.
_LEAST_TIME = 0.5
# Moves shorter than this turn the tool on the spot [mm].
_ON_THE_SPOT = 1e-3
# A blend takes at most this share of the way to the nearer neighbour; below the second it is none [mm].
_BLEND_SHARE, _SMALLEST_BLEND = 0.495, 1e-3
_SPEED_DIGITS, _BLEND_DIGITS = 5, 4
# A joint move that is planned to take no time is given this [s].
_SHORTEST_MOVE = 0.1
_CALLS = {"dispenser": "geo_valve", "uv_lamp": "geo_lamp", "vacuum": "geo_vacuum"}


def written_script(program: RobotProgram, cell: Cell) -> Program:
    """Return the program as URScript; the same input gives the same bytes.

    Args:
        program: that it carries out.
        cell: tool, home and outputs.

    Raises:
        UsageError: an output is none of a UR controller, or the file would be too long.
    """
    orders, placement = program.orders, program.placement
    lines = [f"# {_ascii(sentence)}" for sentence in _header(program, cell)]
    lines += ["def geoprint():", *_settings(placement), *_data(orders, cell, placement), *guard_lines(cell, placement)]
    waiting = waits(orders, cell.signals)
    edges = [0, *(np.flatnonzero(np.diff(orders.runs) != 0) + 1).tolist(), orders.count]
    blends = _blends(orders)
    moves = _moves(orders, blends, cell.process)
    events = _placed(orders, program.events, blends)
    for number, (first, last) in enumerate(pairwise(edges), start=1):
        lines += _run(number, range(max(first, 1), last), moves, events, waiting)
    lines.append("  geo_begin()")
    lines += [f"  geo_run_{number}()" for number in range(1, len(edges))]
    lines += ["  geo_end()", "end", ""]
    if (lines_count := len(lines)) > MOST_LINES:
        raise UsageError(
            f"the URScript program would have {lines_count} lines, allowed are {MOST_LINES}: print with a wider "
            "spacing, or a part of it.",
            lines=lines_count,
        )
    return Program(((FILE, "\n".join(lines)),), targets=orders.count, dry_run=bool(placement.missing))


def _header(program: RobotProgram, cell: Cell) -> list[str]:
    orders, placement = program.orders, program.placement
    sentences = [f"Written by geoprint {version('geoprint')}. Do not edit: change the plan and write it again."]
    if placement.calibrated:
        miss = float(placement.misses.max(initial=0.0))
        sentences.append(f"Fixture calibrated; largest residual of the touched points: {miss:.2f} mm.")
    if placement.missing:
        sentences.append("PLACEMENT UNKNOWN: only runs dry, whatever geo_dry_run is.")
        sentences += [f"Not stated: {what}." for what in placement.missing]
    if program.surface_within is not None:
        sentences.append(f"Surface known within {program.surface_within:.2f} mm along its normal (95 %).")
    return [
        *sentences,
        f"Part: {program.part_name}",
        f"Cell: {cell.name}; robot: {cell.robot.model}",
        f"Spacing: {program.spacing:.4f} mm; runs: {int(orders.runs[-1]) + 1}; targets: {orders.count}",
        "Checked: the text matches the plan: targets, speeds, blends, outputs, frames.",
        *(f"Checked: {sentence}" for sentence in program.checked),
        *(f"Not checked: {sentence}" for sentence in program.not_checked),
        "Not checked: the real cell. Run it dry and slowly first.",
        "Before the first load, follow urscript/controller/first_load.md.",
    ]


def _settings(placement: Placement) -> list[str]:
    dry = ["  # It runs dry in any case: nobody has stated the placement."] if placement.missing else []
    return [
        "  # A person sets these three: dry or not, speed in per cent of the planned one, the run that prints first.",
        *dry,
        "  global geo_dry_run = True",
        "  global geo_speed_pct = 25",
        "  global geo_first_run = 1",
    ]


def _data(orders: Orders, cell: Cell, placement: Placement) -> list[str]:
    """Return tool, load, frames, home and the way to the first target."""
    tool = cell.tool
    first = _poses(orders.tips[:1], orders.quaternions[:1])[0]
    rows = [
        ("geo_runs", str(int(orders.runs[-1]) + 1)),
        ("geo_tcp", _frame(tool.T_flange_tool)),
        ("geo_mass", f"{tool.mass_kg:.4f}"),
        ("geo_cog", _listed(1e-3 * tool.cog, decimals=5)),
        ("geo_inertia", _listed(_inertia(tool), decimals=7)),
        ("geo_fixture", _frame(placement.T_base_fixture)),
        ("geo_part", _frame(placement.T_fixture_work)),
        ("geo_home", _listed(cell.robot.home, decimals=7)),
        ("geo_first", first),
        ("geo_start", _listed(orders.start, decimals=7)),
        ("geo_aloft", _listed(orders.lifted, decimals=7)),
        ("geo_there", f"{max(orders.there, _SHORTEST_MOVE):.4f}"),
        ("geo_back", f"{max(orders.back, _SHORTEST_MOVE):.4f}"),
    ]
    if cell.purge is not None:
        rows.append(("geo_purge", _listed(cell.purge.joints, decimals=7)))
    if cell.flood is not None and cell.flood.joints is not None:
        rows.append(("geo_flooding", _listed(cell.flood.joints, decimals=7)))
    return [f"  global {name} = {value}" for name, value in rows]


def _inertia(tool: Tool) -> FloatArray:
    """Return (6,) Ixx, Iyy, Izz, Ixy, Ixz, Iyz about the centre of gravity, along the axes of the flange [kg m2]."""
    I = tool.principal_axes @ np.diag(tool.inertia_kg_m2) @ tool.principal_axes.T  # noqa: E741
    return np.array([I[0, 0], I[1, 1], I[2, 2], I[0, 1], I[0, 2], I[1, 2]])


def _blends(orders: Orders) -> FloatArray:
    """Return the (t,) radius of the blend of each move [mm]; 0 for a rest."""
    steps = np.linalg.norm(np.diff(orders.tips, axis=0), axis=1)
    nearer = np.minimum(np.append(steps, 0.0), np.append(0.0, steps))
    blends = _rounded_down(np.minimum(orders.zones, _BLEND_SHARE * nearer), digits=_BLEND_DIGITS)
    return np.where(blends < _SMALLEST_BLEND, 0.0, blends)


def _moves(orders: Orders, blends: FloatArray, process: Process) -> list[str]:
    """Return the move to each target; that to the first is made by the guard."""
    steps = np.linalg.norm(np.diff(orders.tips, axis=0), axis=1)
    paces = _paces(orders, steps, blends, process)
    speeds, accelerations = (_rounded_down(each, digits=_SPEED_DIGITS) for each in paces)
    places = _poses(orders.tips, orders.quaternions)
    durations = np.diff(orders.times)
    moves = [""]
    for k in range(1, orders.count):
        at = f"pose_trans(geo_at, {places[k]})"
        if steps[k - 1] < _ON_THE_SPOT:
            moves.append(f"movel({at}, a=1.2, v=0.25, t={max(float(durations[k - 1]), _SHORTEST_MOVE):.4f} / geo_rate)")
            continue
        blend = _plain(1e-3 * float(blends[k]))
        speed = _plain(1e-3 * float(speeds[k]))
        moves.append(f"movep({at}, a={_plain(1e-3 * float(accelerations[k]))}, v=geo_rate * {speed}, r={blend})")
    return moves


def _paces(orders: Orders, steps: FloatArray, blends: FloatArray, process: Process) -> tuple[FloatArray, FloatArray]:
    """Return (t,) speeds [mm/s] and accelerations [mm/s2] of the moves with which they last as planned.

    The planned speed of a move is its mean, in which the ramp from or to a rest counts. A controller makes that ramp at
    the acceleration of the move. So such a move has the speed v of its neighbour, or that of the process, and the
    acceleration a with which it lasts as planned: (B + L) / v + n v / (2 a) = t, for its blend B, line L, time t and n
    rests at its ends. Where that ramp is longer than the line, it is as long: v = (B + 2 L) / t, a = n v^2 / (2 L). A
    blend is gone at the pace of the move behind it: the half that a move from a rest gives away takes time off it, the
    half that one to a rest takes over adds to it.
    """
    half = _half_blends(orders.tips, steps, blends)
    durations, planned = np.diff(orders.times), orders.speeds[1:]
    rests = blends == 0.0
    starts, stops = rests[:-1], rests[1:]
    n = starts.astype(np.float64) + stops
    before, behind = np.append(planned[:1], planned[:-1]), np.append(planned[1:], planned[-1])
    given = np.where(starts & ~stops, half[1:] / behind, 0.0)
    taken = np.where(stops & ~starts, half[:-1] / before, 0.0)
    t = np.maximum(durations - given, _LEAST_TIME * durations) + taken
    L, B = steps - blends[:-1] - blends[1:], np.where(stops & ~starts, 2.0 * half[:-1], 0.0)
    printing = printing_steps(orders.zones == 0.0, orders.deposited[:-1])
    limit = np.where(printing, process.speed, process.travel_speed)
    # The neighbour's speed, where it neither begins nor ends at rest.
    other = np.where(starts, behind, before)
    even = np.where(starts, np.append(n[1:], 1.0), np.append(1.0, n[:-1])) == 0.0
    v = np.where((n == 1.0) & even & (other > planned), other, np.maximum(limit, planned))
    slack = np.maximum(t - (B + L) / v, 1e-9)
    a = np.where(n > 0.0, np.minimum(n * v / (2.0 * slack), _MOST), _ACCELERATION)
    # Without time for a ramp at the most, the way is gone slower.
    root = np.sqrt(np.maximum(t**2 - 2.0 * n * (B + L) / a, 0.0))
    v = np.where(a == _MOST, a / np.maximum(n, 1.0) * (t - root), v)
    long = n * v**2 / (2.0 * a) > L
    v = np.where(long, (B + 2.0 * L) / np.where(t > 0.0, t, 1.0), v)
    a = np.where(long, n * v**2 / (2.0 * np.where(L > 0.0, L, 1.0)), a)
    ramp = (n > 0.0) & (steps > _ON_THE_SPOT)
    speeds, accelerations = np.where(ramp, v, planned), np.where(ramp, a, _ACCELERATION)
    return np.append(orders.speeds[:1], speeds), np.append(_ACCELERATION, accelerations)


def _half_blends(tips: FloatArray, steps: FloatArray, blends: FloatArray) -> FloatArray:
    """Return (t,) half of the arc about each target [mm]: of radius b / tan(angle / 2), over the angle."""
    along = np.diff(tips, axis=0) / np.maximum(steps, _ON_THE_SPOT)[:, None]
    angles = np.arccos(np.clip((along[1:] * along[:-1]).sum(axis=1), -1.0, 1.0))
    flat = angles < 1e-6
    share = np.where(flat, 1.0, 0.5 * angles / np.tan(0.5 * np.where(flat, 1.0, angles)))
    return blends * np.concatenate([[0.0], share, [0.0]])


def _run(
    number: int,
    targets: Sequence[int],
    moves: Sequence[str],
    events: Sequence[tuple[Event, int, str]],
    waiting: FloatArray,
) -> list[str]:
    """Return the thread that switches in a run, and the function that moves."""
    thread: list[str] = []
    for event, step, place in events:
        if event.target in targets:
            thread += [f"    geo_wait({step}, {place})", f"    {_CALLS[event.output]}({event.on})"]
    if thread:
        thread = [f"  thread geo_switch_{number}():", *thread, "  end"]
    lines = [*thread, f"  def geo_run_{number}():", f"    geo_enter({number})"]
    lines += [f"    local switching = run geo_switch_{number}()"] if thread else []
    for target in targets:
        lines += [f"    global geo_step = {target}", f"    {moves[target]}"]
        if waiting[target] > 0.0:
            lines += [f"    global geo_step = {target}.5", "    if geo_on:"]
            lines += [f"      sleep({_plain(round(float(waiting[target]), 6))})", "    end"]
    lines += [f"    global geo_step = {targets[-1] + 1}"] if targets else []
    lines += ["    join switching"] if thread else []
    return [*lines, "  end"]


def _placed(orders: Orders, events: Sequence[Event], blends: FloatArray) -> list[tuple[Event, int, str]]:
    """Return the events in the order of the path, each with the move during which the tip passes its place, and that.

    A blend belongs to the move behind its target. The place is a pose whose z axis is the path there.
    """
    steps = np.diff(orders.tips, axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    along = steps / np.maximum(lengths, _ON_THE_SPOT)[:, None]
    found: list[tuple[int, float, Event, int, str]] = []
    for event in events:
        move = event.target - 1
        gone = event.distance if event.from_start else float(lengths[move]) - event.distance
        place = orders.tips[move] + gone * along[move]
        axis = _direction(orders, along, event.target, gone, length=float(lengths[move]))
        step = event.target + int(lengths[move] - gone < blends[event.target])
        found.append((event.target, gone, event, step, _written_pose(place, _turn_to(axis))))
    return [each[2:] for each in sorted(found, key=lambda each: each[:2])]


def _direction(orders: Orders, along: FloatArray, target: int, gone: float, *, length: float) -> FloatArray:
    """Return the direction of the path so far on the move to a target: within a corner between those of both moves."""
    own = along[target - 1]
    for zone, to_corner, other in (
        (orders.zones[target], length - gone, target),
        (orders.zones[target - 1], gone, target - 2),
    ):
        if 0 <= other < len(along) and to_corner < zone:
            own = own + (0.5 - 0.5 * to_corner / zone) * (along[other] - along[target - 1])
    size = float(np.linalg.norm(own))
    return own / size if size > 0.1 else np.array([0.0, 0.0, 1.0])


def _turn_to(axis: FloatArray) -> FloatArray:
    """Return the rotation vector that turns z to an axis."""
    z = np.array([0.0, 0.0, 1.0])
    cross = np.cross(z, axis)
    sine, cosine = float(np.linalg.norm(cross)), float(axis[2])
    if sine < 1e-9:
        return np.array([0.0, 0.0, 0.0]) if cosine > 0.0 else np.array([np.pi, 0.0, 0.0])
    return cross / sine * np.arctan2(sine, cosine)


def _poses(tips: FloatArray, quaternions: FloatArray) -> list[str]:
    """Return (k, 3) tips [mm] and (k, 4) attitudes as poses."""
    turns = Rotation.from_quat(quaternions, scalar_first=True).as_rotvec()
    return [_written_pose(tip, turned) for tip, turned in zip(tips, turns, strict=True)]


def _frame(T: FloatArray) -> str:
    return _written_pose(T[:3, 3], Rotation.from_matrix(T[:3, :3]).as_rotvec())


def _written_pose(place: FloatArray, turned: FloatArray) -> str:
    """Return p[...] of a position [mm] and a rotation vector."""
    numbers = np.round(np.concatenate([1e-3 * place, turned]), 7) + 0.0
    return f"p[{','.join(f'{each:.7f}' for each in numbers.tolist())}]"


def _listed(values: FloatArray, *, decimals: int) -> str:
    return f"[{','.join(f'{each:.{decimals}f}' for each in (np.round(values, decimals) + 0.0).tolist())}]"


def _rounded_down(values: FloatArray, *, digits: int) -> FloatArray:
    """Return values with so many significant digits, never more than they are."""
    steps = 10.0 ** (digits - 1 - np.floor(np.log10(np.maximum(values, 1e-9))))
    return np.where(values > 0.0, np.floor(values * steps * (1.0 + 1e-12)) / steps, 0.0)


def _plain(value: float) -> str:
    return f"{value:.9f}".rstrip("0").rstrip(".")


def _ascii(text: str) -> str:
    return "".join(letter if " " <= letter <= "~" else "?" for letter in text)
