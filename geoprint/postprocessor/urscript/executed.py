"""Executes a URScript program dry, printing, resumed and stopped, and holds what it does against the plan."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TypeAlias, cast, final

import numpy as np

from geoprint import transforms
from geoprint.errors import VerificationError, how_many, percent
from geoprint.model import BoolArray, Cell, FloatArray, Placement
from geoprint.postprocessor.execution import Executed, NotExecuted, Switched, refusal
from geoprint.postprocessor.expected import LIFT, expected_waits, largest_zones
from geoprint.postprocessor.interface import Execution, RobotProgram
from geoprint.postprocessor.orders import Event
from geoprint.postprocessor.timeline import moment_on
from geoprint.postprocessor.urscript.execution import execute
from geoprint.postprocessor.urscript.forms import (
    FILE,
    guard_of,
    read_script,
    settings_of,
    wrong_guard,
    wrong_settings,
    wrong_statements,
)
from geoprint.postprocessor.urscript.guard import output_of
from geoprint.postprocessor.urscript.language import Script
from geoprint.postprocessor.urscript.log import (
    FRAME,
    Made,
    Scenario,
    Switch,
    durations,
    lengths,
    pieces_by_move,
    tip_at,
)
from geoprint.postprocessor.urscript.motion import Arc, Line, Piece, Rest
from geoprint.postprocessor.urscript.poses import Pose, angle_between, pose_of_matrix, position, product, turn
from geoprint.robot.arm import Arm

# How far a target may lie from the plan's [mm], and how far its attitude be turned [rad].
MOST_MOTION, MOST_TURN = 1e-3, 1e-5
# An output switches when the tip passes its place, to this [s]; the place is written to this [mm].
MOST_DELAY, MOST_PLACE = 2e-3, 5e-4
# How much longer or shorter than planned a move, and all moves of a run together, may take [s, share].
MOST_MOVE_TIME, MOST_RUN_TIME = 0.02, 0.05
# A blend is rounded down by this share at most, and takes less than half of the way to a neighbour.
_LEAST_BLEND, _HALF = 0.988, 0.5
# Rounding of a speed, never above the plan; the rest of it is what numbers of a file are worth.
_LEAST_SPEED, _EXCESS = 0.9999, 1e-6
# A zone is read from a table of six decimals [mm].
_NO_EXCESS = 1e-5
# Speeds that follow from lengths and times as they are written.
_SAME_SPEED = 2e-3
# The same of the time that a ramp costs [s].
_SAME_RAMP = 2e-4
# Moves shorter than this turn the tool [mm]; blends below this are stops [mm].
_ON_THE_SPOT, _NO_BLEND = 1e-3, 1.01e-3
# Acceleration along the path, the default of movep, and the most in a ramp [m/s2].
_ACCELERATION, _MOST = 1.2, 10.0
# A joint is written to this [rad], a length to this [m], a time of a joint move to this [s].
_JOINT, _LENGTH, _TIME = 1e-6, 2e-7, 1e-3
# Farther from home than the guard lets pass unasked [rad].
_FAR = math.radians(10.0)
_SHORTEST_MOVE = 0.1
_NOT_KNOWN = (
    "how the controller looks ahead: its ramps, and its speed in blends and on short moves",
    "how late outputs follow the frame in which they are set",
    "what the controller does while a program is paused",
)
_ELSE = "an answer or a value that no scenario brings here"


@final
@dataclass(frozen=True, slots=True)
class Passed:
    """When the tip passes the place of an event, and where: time [s], and the place [mm]."""

    time: float
    place: FloatArray
    away: float


def execution_of(
    files: Mapping[str, str], program: RobotProgram, cell: Cell, events: Sequence[Event], *, new: bool = False
) -> Execution:
    """Execute files, and hold what they do against the plan.

    Args:
        files: name and text.
        program: what it was written for.
        cell: arm, tool, outputs.
        events: where outputs must switch.
        new: whether the settings must be those of a new program.
    """
    try:
        script = read_script(files)
        settings = settings_of(script)
    except VerificationError as error:
        return Execution((error,))
    judge = _Judge(script, program, cell, tuple(events))
    guard = guard_of(files[FILE], cell, program.placement)
    findings = [*wrong_guard(files[FILE], cell, program.placement), *wrong_statements(script, cell, guard)]
    runs = int(program.orders.runs[-1]) + 1
    findings += wrong_settings(script, settings, runs=runs, new=new)
    try:
        made = judge.made("printing", printing(cell, program.placement))
    except VerificationError as error:
        return Execution((*findings, error))
    findings += judge.motion(made, lifted_runs=runs if program.placement.missing else 0, rate=1.0)
    found, switched, outputs = judge.switching(made)
    findings += found
    ran = [made]
    for case in (judge.dry, judge.resumed, judge.stopped, judge.refusals):
        try:
            wrong, more = case(made)
        except VerificationError as error:
            wrong, more = [error], []
        findings += wrong
        ran += more
    executed = judge.figures(made, ran, outputs)
    findings += _beyond(executed)
    left = [line for each in executed.not_executed for line in each.lines if line not in guard]
    if left:
        findings.append(refusal(FILE, left[0], "no scenario executes this statement, and it is none of the guard"))
    lines = tuple((FILE, move.line) for move in (made.start, *made.path))
    complete = len(lines) == program.orders.count
    return Execution(tuple(findings), executed, switched, lines if complete else (), None if findings else settings)


def printing(cell: Cell, placement: Placement, *, first: int = 1) -> Scenario:
    """Return how a program prints; where nobody has stated the placement, what it would do if it could."""
    settings = (("geo_dry_run", False), ("geo_speed_pct", 100), ("geo_first_run", first))
    held = (("geo_on", True),) if placement.missing else ()
    return Scenario(tuple(cell.robot.home.tolist()), settings, held)


# Where something is wrong, and what to say of a target.
_Compared: TypeAlias = tuple[BoolArray, Callable[[int], str]]


@final
class _Judge:
    """Executes a program in its scenarios, and compares."""

    def __init__(self, script: Script, program: RobotProgram, cell: Cell, events: tuple[Event, ...]) -> None:
        self.script, self.cell, self.orders, self.placement = script, cell, program.orders, program.placement
        self.tips_at = program.tips_at
        bare = Arm(cell.robot, T_flange_tool=np.eye(4))
        self.flange: Callable[[FloatArray], FloatArray] = bare.tool_poses
        self.runs = int(self.orders.runs[-1]) + 1
        self.waits = expected_waits(self.orders, cell.signals)
        self.events = self._in_order(events)
        signals = cell.signals
        names = {"dispenser": signals.dispenser, "uv_lamp": signals.uv_lamp, "vacuum": signals.vacuum}
        self.names = {output: name for output, name in names.items() if name is not None}
        self.outputs = {" ".join(map(str, output_of(name))): output for output, name in self.names.items()}
        self.lift = np.array([0.0, 0.0, LIFT])

    def _in_order(self, events: Sequence[Event]) -> list[tuple[Event, FloatArray]]:
        """Return the events in the order of the path, each with its place in the work frame [mm]."""
        found: list[tuple[int, float, Event, FloatArray]] = []
        for event in events:
            start, end = self.orders.tips[event.target - 1], self.orders.tips[event.target]
            length = float(np.linalg.norm(end - start))
            gone = event.distance if event.from_start else length - event.distance
            found.append((event.target, gone, event, start + (end - start) * (gone / max(length, _ON_THE_SPOT))))
        return [(event, place) for _, _, event, place in sorted(found, key=lambda each: each[:2])]

    def made(self, name: str, scenario: Scenario) -> Made:
        """Execute the program.

        Raises:
            VerificationError: it does not run to its end, or does not go as many ways as there are targets.
        """
        log = execute(self.script, scenario, self.flange)
        if log.ended != "end":
            said = f": {log.asked[-1]}" if log.asked else ""
            raise refusal(FILE, max(log.lines), f"{name}, the program does not run to its end{said}")
        moves = log.moves
        on_path = [k for k, move in enumerate(moves) if move.verb != "movej"]
        wanted = self.orders.count - 1
        around = 2 + 2 * (self.cell.purge is not None) + 1
        after = 1 + 2 * (self.cell.flood is not None and self.cell.flood.joints is not None)
        before = around - 1
        if len(on_path) != wanted or on_path != list(range(before, before + wanted)):
            line = moves[min(before, len(moves) - 1)].line if moves else 1
            count = how_many(len(on_path), "move")
            raise refusal(FILE, line, f"{name}, there are {count} along the path in a row, planned are {wanted}")
        if len(moves) != before + wanted + after:
            raise refusal(FILE, moves[-1].line, f"{name}, there are other joint moves around the path than planned")
        return Made(name, log, tuple(moves[before : before + wanted]), moves[before - 1])

    def motion(self, made: Made, *, lifted_runs: int, rate: float) -> Iterator[VerificationError]:
        """Yield what is wrong with the moves: the first of each kind.

        Args:
            made: that was executed.
            lifted_runs: so many runs at the beginning are driven higher.
            rate: of the planned speeds.
        """
        yield from self._around(made, lifted=lifted_runs > 0, rate=rate)
        moves = (made.start, *made.path)
        for wrong, says in (*self._placed(made, lifted_runs), *self._paced(made, rate), *self._rounded(made)):
            for k in map(int, np.flatnonzero(wrong)[:1]):
                yield refusal(FILE, moves[k].line, f"{made.name}, target {k + 1}: {says(k)}")
        yield from self._waiting(made, lifted_runs=lifted_runs)

    def _placed(self, made: Made, lifted_runs: int) -> tuple[_Compared, ...]:
        """Return where the tool goes elsewhere, turned otherwise, or while the counter says another target."""
        moves = (made.start, *made.path)
        places, turns = self.targets(lifted_runs)
        found = 1e3 * np.array([position(move.target) for move in moves])
        away = np.linalg.norm(found - places, axis=1)
        turned = np.array([angle_between(turn(move.target), one) for move, one in zip(moves, turns, strict=True)])
        counted = np.array([False, *(move.step != k for k, move in enumerate(made.path, start=1))])
        return (
            (away > MOST_MOTION, lambda k: f"the tool goes {away[k]:.4f} mm beside it"),
            (turned > MOST_TURN, lambda k: f"the tool is turned by {turned[k]:.2g} rad"),
            (counted, lambda k: f"geo_step is {moves[k].step!r} on the way there"),
        )

    def _paced(self, made: Made, rate: float) -> tuple[_Compared, ...]:
        """Return where a move is of another kind, speed, acceleration or time than planned."""
        moves = (made.start, *made.path)
        reached, accelerations = self._paces(made)
        planned, rates = np.append(0.0, rate * reached), np.append(0.0, 1e-3 * accelerations)
        speeds = np.array([1e3 * move.speed for move in moves])
        ramp = np.append(np.False_, self._rests(made) > 0.0)
        low = planned * np.where(ramp, 1.0 - _SAME_SPEED, _LEAST_SPEED)
        high = planned * (1.0 + np.where(ramp, _SAME_SPEED, _EXCESS))
        # Moves without way turn the tool in a given time; that to the first target is no move on the path.
        spot = np.append(np.True_, np.linalg.norm(np.diff(self.orders.tips, axis=0), axis=1) < _ON_THE_SPOT)
        turning = spot & (np.arange(spot.size) > 0)
        seconds = np.array([move.seconds for move in moves])
        durations = np.append(0.0, np.maximum(np.diff(self.orders.times), _SHORTEST_MOVE) / rate)
        verbs = np.array([move.verb == wanted for move, wanted in zip(moves, _verbs(spot), strict=True)])
        found = np.array([move.acceleration for move in moves])
        # What a ramp costs counts, half of speed over acceleration: where that is little, rounding is much of it.
        costs = [5e-4 * speeds / np.maximum(each, 1e-9) for each in (found, rates)]
        kept = np.abs(costs[0] - costs[1]) <= np.maximum(_SAME_SPEED * costs[1], _SAME_RAMP)
        uneven = np.where(ramp, ~kept, np.abs(found - rates) > _EXCESS * rates)
        return (
            (~verbs, lambda k: f"{moves[k].verb} is another kind of move than planned"),
            (
                ~spot & ((speeds > high) | (speeds < low)),
                lambda k: f"the speed is {speeds[k]:g} mm/s, planned {planned[k]:g}",
            ),
            (~spot & uneven, lambda k: f"the acceleration is {found[k]:g} m/s2, planned {rates[k]:g}"),
            (
                turning & (np.abs(seconds - durations) > _TIME),
                lambda k: f"the turn takes {seconds[k]:g} s, planned {durations[k]:g}",
            ),
        )

    def _rounded(self, made: Made) -> tuple[_Compared, ...]:
        """Return where a blend is larger or smaller than planned."""
        orders = self.orders
        steps = np.linalg.norm(np.diff(orders.tips, axis=0), axis=1)
        nearer = np.minimum(np.append(steps, 0.0), np.append(0.0, steps))
        zones = np.minimum(np.minimum(orders.zones, largest_zones(orders) + _EXCESS), _HALF * nearer)
        blends = np.array([0.0, *(1e3 * move.blend for move in made.path)])
        least = np.where(zones < _NO_BLEND, 0.0, _LEAST_BLEND * zones - _NO_BLEND * 0.01)
        wrong = (blends > zones + _NO_EXCESS) | (blends < least) | ((zones < _EXCESS) & (blends > 0.0))
        wrong[0] = False
        return ((wrong, lambda k: f"the blend is {blends[k]:g} mm, planned {zones[k]:g}"),)

    def _rests(self, made: Made) -> FloatArray:
        """Return (t - 1,) at how many of its ends each move rests."""
        stops = np.array([True, *(move.blend == 0.0 for move in made.path)])
        return stops[:-1].astype(np.float64) + stops[1:]

    def _ways(self, made: Made) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return (t - 1,) blend and line that each move makes at its own speed [mm], and in which time it must [s].

        A blend is gone at the speed of the move that it leads to. So a move that ends in one after a rest has less time
        than planned, by what half of it takes; one that begins with one before a rest has as much more.
        """
        orders, moves = self.orders, (made.start, *made.path)
        steps = np.linalg.norm(np.diff(orders.tips, axis=0), axis=1)
        driven = 1e3 * np.array([math.dist(position(a.target), position(b.target)) for a, b in pairwise(moves)])
        arcs, lines = lengths(made)
        following = np.append(arcs[1:], 0.0)
        planned, times = orders.speeds[1:], np.diff(orders.times)
        rests = [True, *(move.blend == 0.0 for move in made.path)]
        for k, (starts, stops) in enumerate(pairwise(rests)):
            if starts and not stops:
                times[k] = max(times[k] - 0.5 * following[k] / planned[k + 1], 0.5 * times[k])
            elif stops and not starts:
                times[k] += 0.5 * arcs[k] / planned[k - 1]
        # A descent to a run is paced as its move in the print.
        return arcs, lines + steps - driven, times

    def _paces(self, made: Made) -> tuple[FloatArray, FloatArray]:
        """Return (t - 1,) speeds [mm/s] and accelerations [mm/s2] with which the moves last as planned.

        Planned speeds are means of a move. One that begins or ends at rest has ramps: it reaches the speed of a
        neighbour without any, or that of the process, at the acceleration that leaves it its time.
        """
        orders, process = self.orders, self.cell.process
        rests, (arcs, lines, times) = self._rests(made), self._ways(made)
        speeds, accelerations = orders.speeds[1:].copy(), np.full(rests.size, 1e3 * _ACCELERATION)
        begins = [True, *(move.blend == 0.0 for move in made.path)]
        for k in np.flatnonzero((rests > 0.0) & (lines > _ON_THE_SPOT)).tolist():
            n, line, time, mean = float(rests[k]), float(lines[k]), float(times[k]), float(orders.speeds[k + 1])
            way = line + float(arcs[k])
            other = k + 1 if begins[k] else k - 1
            reached = max(process.speed if orders.deposited[k] else process.travel_speed, mean)
            if n == 1.0 and 0 <= other < rests.size and rests[other] == 0.0 and orders.speeds[other + 1] > mean:
                reached = float(orders.speeds[other + 1])
            ramp, acceleration = time - way / reached, 1e3 * _MOST
            if ramp > 0.0 and n * reached / (2.0 * ramp) < acceleration:
                acceleration = n * reached / (2.0 * ramp)
            else:
                # v^2 n / (2 a) - t v + L = 0.
                inner = max(time**2 - 2.0 * n * way / acceleration, 0.0)
                reached = 2.0 * way / (time + math.sqrt(inner))
            if n * reached**2 > 2.0 * acceleration * line:
                reached = (way + line) / time
                acceleration = n * reached**2 / (2.0 * line)
            speeds[k], accelerations[k] = reached, acceleration
        return speeds, accelerations

    def _timed(self, made: Made) -> FloatArray:
        """Return (t - 1,) how long each move takes by its own speed and acceleration, with its half of each blend [s].

        Which speed a blend has nobody promises: by the clock of the machine, moves beside a slow one take longer, and
        it less, which evens out along a run.
        """
        arcs, lines = lengths(made)
        following, rests = np.append(arcs[1:], 0.0), self._rests(made)
        speeds = np.array([1e3 * move.speed for move in made.path])
        ramps = np.array([0.5 * move.speed / move.acceleration for move in made.path])
        took = lines / speeds + rests * ramps + 0.5 * (arcs + following) / speeds
        planned = self.orders.speeds[1:]
        for k in np.flatnonzero(rests == 1.0).tolist():
            if following[k] > 0.0:
                took[k] += 0.5 * following[k] * (1.0 / planned[k + 1] - 1.0 / speeds[k])
            elif arcs[k] > 0.0:
                took[k] += arcs[k] / speeds[k] - 0.5 * arcs[k] * (1.0 / speeds[k] + 1.0 / planned[k - 1])
        return took

    def targets(self, lifted_runs: int) -> tuple[FloatArray, list[tuple[float, float, float, float]]]:
        """Return where the targets must be in the base frame [mm], and their attitudes."""
        T = self.placement.T_base_work
        places = transforms.apply(T, self.orders.tips)
        places[self.orders.runs < lifted_runs] += self.lift
        frame = turn(pose_of_matrix(T))
        return places, [product(frame, (w, x, y, z)) for w, x, y, z in self.orders.quaternions.tolist()]

    def _waiting(self, made: Made, *, lifted_runs: int) -> Iterator[VerificationError]:
        """Yield where the arm rests for longer or shorter than wanted."""
        known = not self.placement.missing
        for k, (move, following) in enumerate(zip(made.path, made.path[1:], strict=False), start=1):
            if move.blend > 0.0:
                continue
            own = bool(self.orders.runs[k] >= lifted_runs) if known else made.name != "dry"
            wanted = float(self.waits[k]) if own else 0.0
            rest = following.issued - move.ends
            if rest < wanted - 1e-6 or rest > wanted + 2.0 * FRAME * (4.0 if made.name == "dry" else 1.0):
                what = f"the arm rests {rest:.4f} s at target {k + 1}, planned are {wanted:.4f} s"
                yield refusal(FILE, following.line, f"{made.name}, {what}")
                return

    def _around(self, made: Made, *, lifted: bool, rate: float) -> Iterator[VerificationError]:
        """Yield what is wrong with tool, load, and the moves from and to home."""
        tool, log, orders = self.cell.tool, made.log, self.orders
        line = made.start.line
        wanted = pose_of_matrix(tool.T_flange_tool)
        tools = [each for _, each in log.tools]
        if len(tools) != 1 or max(abs(a - b) for a, b in zip(tools[0], wanted, strict=True)) > 2.0 * _LENGTH:
            yield refusal(FILE, line, f"{made.name}, the tool is not that of the cell")
        I = tool.principal_axes @ np.diag(tool.inertia_kg_m2) @ tool.principal_axes.T  # noqa: E741
        load = [
            tool.mass_kg,
            *(1e-3 * tool.cog).tolist(),
            *np.diag(I).tolist(),
            float(I[0, 1]),
            float(I[0, 2]),
            float(I[1, 2]),
        ]
        loads = [_flat(each) for _, each in log.loads]
        if len(loads) != 1 or len(loads[0]) != 10 or np.abs(np.array(loads[0]) - load).max() > 1e-5:
            yield refusal(FILE, line, f"{made.name}, the load is not that of the cell")
        home, start = self.cell.robot.home, orders.lifted if lifted else orders.start
        joint_moves = [move for move in log.moves if move.verb == "movej"]
        aims: list[tuple[FloatArray, float, float]] = [(home, 0.0, _JOINT)]
        if self.cell.purge is not None:
            aims += [(self.cell.purge.joints, 0.0, _JOINT), (home, 0.0, _JOINT)]
        # The controller solves the pose of the first target near the planned joints.
        aims.append((start, max(orders.there, _SHORTEST_MOVE) / rate, 1e-4))
        aims.append((home, max(orders.back, _SHORTEST_MOVE) / rate, _JOINT))
        if self.cell.flood is not None and self.cell.flood.joints is not None:
            aims += [(self.cell.flood.joints, 0.0, _JOINT), (home, 0.0, _JOINT)]
        for move, (joints, seconds, most) in zip(joint_moves, aims, strict=True):
            if np.abs(np.array(move.joints) - joints).max() > most:
                yield refusal(FILE, move.line, f"{made.name}, this joint move leads elsewhere than planned")
            elif abs(move.seconds - seconds) > _TIME:
                yield refusal(
                    FILE, move.line, f"{made.name}, this move takes {move.seconds:g} s, planned {seconds:g} s"
                )

    # Switchings.

    def switching(self, made: Made) -> tuple[list[VerificationError], tuple[Switched, ...], float]:
        """Return what is wrong with the switchings of a print, what switches by the planned clock, and how far off."""
        findings, switched, farthest = self._switched(made, self.events)
        findings += self._by_hand(made)
        return findings, switched, farthest

    def _switched(
        self, made: Made, events: Sequence[tuple[Event, FloatArray]]
    ) -> tuple[list[VerificationError], tuple[Switched, ...], float]:
        findings: list[VerificationError] = []
        sets = [each for each in made.log.switches if each.thread != self.script.main.name]
        waits = [each for each in made.log.calls if each.name == "geo_wait"]
        if len(sets) != len(events) or len(waits) != len(events):
            line = sets[-1].line if sets else 1
            what = f"{made.name}, threads switch {how_many(len(sets), 'time')}, planned are {len(events)}"
            return [refusal(FILE, line, what)], self._all_switched(made, sets), math.inf
        farthest = 0.0
        pieces = pieces_by_move(made.log)
        first = next(k for k, move in enumerate(made.log.moves) if move is made.path[0])
        for each, (event, place), wait in zip(sets, events, waits, strict=True):
            output = self.outputs.get(each.output)
            if output != event.output or each.on != event.on:
                what = f"{each.output} is set to {each.on}, planned is {event.output} {event.on}"
                findings.append(refusal(FILE, each.line, f"{made.name}, {what}"))
                continue
            said, there = wait.arguments[0], wait.arguments[1]
            asked = np.array(position(there)) * 1e3 if isinstance(there, Pose) else np.full(3, np.inf)
            off = float(np.linalg.norm(asked - place))
            move = event.target + self._in_blend(made, event)
            if said != move or off > MOST_PLACE:
                what = f"it waits for a place {off:.4f} mm beside the planned one, in the move to target {said!r}"
                findings.append(refusal(FILE, wait.line, f"{made.name}, {what} (planned {move})"))
            passed = self._passed(made, pieces, first, event, place)
            late = each.time - passed.time
            if event.from_start and self.waits[event.target - 1] > 0.0 and event.distance == 0.0:
                late = each.time - made.path[event.target - 1].begins
            if abs(late) > MOST_DELAY:
                what = f"{output} switches {1e3 * late:+.2f} ms off the moment when the tip passes its place"
                findings.append(refusal(FILE, each.line, f"{made.name}, {what}"))
            tip = tip_at(made, each.time)
            farthest = max(farthest, float(np.linalg.norm(tip - passed.place)))
        return findings, self._all_switched(made, sets), farthest

    def _in_blend(self, made: Made, event: Event) -> bool:
        """Tell whether the place of an event lies in the blend before its target, which the next move has begun by."""
        left = event.distance
        if event.from_start:
            left = float(np.linalg.norm(np.diff(self.orders.tips[event.target - 1 : event.target + 1], axis=0))) - left
        return left < 1e3 * made.path[event.target - 1].blend

    def _passed(
        self, made: Made, pieces: Mapping[int, list[Piece]], first: int, event: Event, place: FloatArray
    ) -> Passed:
        """Return when the tip passes the place of an event, on the move that carries it or the corners about it."""
        there = self._in_base(made, place)
        number = first + event.target - 1
        own = pieces.get(number, [])
        following = [piece for piece in pieces.get(number + 1, []) if isinstance(piece.way, Arc)]
        found: list[tuple[float, int, Passed]] = []
        x, y, z = (1e-3 * there).tolist()
        target = (float(x), float(y), float(z))
        for rank, piece in enumerate([*own, *following]):
            way = piece.way
            if isinstance(way, Rest):
                time, at = (piece.begins if event.from_start else piece.ends), way.place(0.0)
            elif isinstance(way, (Line, Arc)):
                gone = way.nearest(target)
                time, at = piece.passed(gone), way.place(gone)
            else:
                continue
            away = math.dist(at, target)
            found.append((round(1e3 * away, 5), rank, Passed(time, 1e3 * np.array(at), 1e3 * away)))
        if not found:
            return Passed(math.inf, there, math.inf)
        return min(found, key=lambda each: each[:2])[2]

    def _in_base(self, made: Made, place: FloatArray) -> FloatArray:
        """Return a place of the plan in the base frame, as high as the program drives it [mm]."""
        found = transforms.apply(self.placement.T_base_work, place[None, :])[0]
        return found + self.lift if self.placement.missing or made.name == "dry" else found

    def _all_switched(self, made: Made, sets: Sequence[Switch]) -> tuple[Switched, ...]:
        """Return what threads switch, by the clock of the planned motion."""
        names = {key: self.names[output].lower() for key, output in self.outputs.items()}
        begins = np.array([move.begins for move in made.path])
        T_work_base = transforms.inverse(self.placement.T_base_work)
        found: list[Switched] = []
        for each in sets:
            target = max(int(np.searchsorted(begins, each.time + 1e-9, side="right")), 1)
            move, before = made.path[target - 1], (made.path[target - 2] if target > 1 else made.start)
            tip = tip_at(made, each.time) - (self.lift if self.placement.missing else 0.0)
            tip = transforms.apply(T_work_base, tip[None, :])[0]
            if each.time > move.ends and move.blend == 0.0:
                # While the arm waits at the target, or when it has just come there.
                moment = float(self.orders.times[target])
            elif np.linalg.norm(tip - self.orders.tips[target - 1]) < MOST_PLACE:
                rest = max(each.time - before.ends, 0.0) if before.blend == 0.0 else 0.0
                moment = float(self.orders.times[target - 1]) + rest
            else:
                # A move begins with the blend before it, whose first half lies before the target that it goes around.
                target -= int(before.blend > 0.0 and self._before(tip, target - 1))
                distance = float(np.linalg.norm(tip - self.orders.tips[target]))
                moment = moment_on(target, distance, self.orders, self.tips_at, from_start=False)
            found.append(Switched(moment, names.get(each.output, each.output), each.on, FILE, each.line))
        return tuple(found)

    def _before(self, tip: FloatArray, target: int) -> bool:
        """Tell whether a tip in the blend about a target has not come past it."""
        return bool(
            (tip - self.orders.tips[target]) @ np.diff(self.orders.tips[target - 1 : target + 1], axis=0)[0] < 0.0
        )

    def _by_hand(self, made: Made) -> Iterator[VerificationError]:
        """Yield what the program itself switches on, but for priming and the final exposure, and what stays on."""
        own = [each for each in made.log.switches if each.thread == self.script.main.name]
        known = not self.placement.missing
        wanted: list[tuple[str, float]] = []
        if known and self.cell.purge is not None:
            wanted.append(("dispenser", self.cell.purge.duration))
        if known and self.cell.flood is not None and self.cell.flood.joints is not None:
            wanted.append(("uv_lamp", self.cell.flood.duration))
        on = [(k, each) for k, each in enumerate(own) if each.on]
        if len(on) != len(wanted):
            line = on[0][1].line if on else made.start.line
            yield refusal(FILE, line, f"{made.name}, outputs are switched on beside the path otherwise than planned")
            return
        for (k, each), (output, seconds) in zip(on, wanted, strict=True):
            off = next((other for other in own[k + 1 :] if other.output == each.output and not other.on), None)
            if self.outputs.get(each.output) != output or off is None or abs(off.time - each.time - seconds) > 0.01:
                yield refusal(FILE, each.line, f"{made.name}, {each.output} is on otherwise than for {seconds:g} s")
        states = {each.output: each.on for each in made.log.switches}
        for output, is_on in states.items():
            if is_on:
                yield refusal(FILE, made.start.line, f"{made.name}, {output} is never switched off")

    # The other scenarios.

    def dry(self, made: Made) -> tuple[list[VerificationError], list[Made]]:
        """Execute the program as it is written: dry, at a quarter of the speed, from the first run."""
        del made
        scenario = Scenario(
            tuple(self.cell.robot.home.tolist()),
            (("geo_dry_run", True), ("geo_speed_pct", 25), ("geo_first_run", 1)),
            frame=4.0 * FRAME,
        )
        lifted = self.made("dry", scenario)
        findings = [*self.motion(lifted, lifted_runs=self.runs, rate=0.25)]
        on = [each for each in lifted.log.switches if each.on]
        if on:
            findings.append(refusal(FILE, on[0].line, f"{on[0].output} is switched on here in a dry run"))
        return findings, [lifted]

    def resumed(self, made: Made) -> tuple[list[VerificationError], list[Made]]:
        """Execute the program from a run in the middle on: before it all is dry and higher, behind it as printed."""
        first = self.runs // 2 + 1
        if first == 1:
            return [], []
        again = self.made(f"resumed at run {first}", printing(self.cell, self.placement, first=first))
        missing = bool(self.placement.missing)
        findings = [*self.motion(again, lifted_runs=self.runs if missing else first - 1, rate=1.0)]
        behind = int(np.argmax(self.orders.runs == first - 1))
        begins = again.path[behind - 1].begins
        early = [each for each in again.log.switches if each.on and each.time < begins - FRAME]
        purged = self.cell.purge is not None and not missing
        if len(early) > purged and not missing:
            findings.append(refusal(FILE, early[-1].line, f"resumed at run {first}, it is switched on before that run"))
        since = [(each.line, each.on) for each in again.log.switches if each.time >= begins - FRAME]
        start = made.path[behind - 1].begins
        wanted = [(each.line, each.on) for each in made.log.switches if each.time >= start - FRAME]
        if since != wanted:
            line = next((a[0] for a, b in zip(since, wanted, strict=False) if a != b), 1)
            findings.append(refusal(FILE, line, f"resumed at run {first}, other outputs switch than when it prints"))
        return findings, [again]

    def stopped(self, made: Made) -> tuple[list[VerificationError], list[Made]]:
        """Stop the program in the middle of its first deposit: every output must be low then."""
        on = next(
            (each for each in made.log.switches if each.on and self.outputs.get(each.output) == "dispenser"), None
        )
        if on is None:
            return [], []
        later = (each.time for each in made.log.switches if each.time > on.time and each.output == on.output)
        scenario = printing(self.cell, self.placement)
        # A valve that nothing shuts is found elsewhere.
        until = 0.5 * (on.time + next(later, on.time + 1.0))
        log = execute(
            self.script, Scenario(scenario.joints, scenario.settings, scenario.held, stops_at=until), self.flange
        )
        if log.lit:
            return [refusal(FILE, on.line, f"stopped while it deposits, {', '.join(log.lit)} stays on")], []
        return [], [Made("stopped in the first deposit", log, (), made.start)]

    def refusals(self, made: Made) -> tuple[list[VerificationError], list[Made]]:
        """Execute what must be refused before anything moves."""
        base = dict(printing(self.cell, self.placement).settings)
        cases: dict[str, dict[str, float | int | bool]] = {
            "speed 0": {"geo_dry_run": True, "geo_speed_pct": 0},
            "speed 101": {"geo_dry_run": True, "geo_speed_pct": 101},
            "first run 0": {"geo_first_run": 0},
            f"first run {self.runs + 1}": {"geo_first_run": self.runs + 1},
        }
        if not self.placement.missing:
            cases["printing at 50 per cent"] = {"geo_speed_pct": 50}
        home = self.cell.robot.home.tolist()
        scenarios = {name: Scenario(tuple(home), tuple((base | own).items())) for name, own in cases.items()}
        settings = tuple((base | {"geo_dry_run": True}).items())
        for axis in range(6):
            away = [angle + (_FAR if k == axis else 0.0) for k, angle in enumerate(home)]
            name = f"axis {axis + 1} far from home, and stopped"
            scenarios[name] = Scenario(tuple(away), settings, goes_on=False)
        if not self.placement.missing:
            scenarios["asked whether it may print, and stopped"] = Scenario(
                tuple(home), tuple(base.items()), goes_on=False
            )
        ran: list[Made] = []
        for name, scenario in scenarios.items():
            log = execute(self.script, scenario, self.flange)
            if log.ended != "halt" or log.moves:
                line = log.moves[0].line if log.moves else 1
                return [refusal(FILE, line, f"{name}: the program must end before it moves, and it does not")], ran
            ran.append(Made(name, log, (), made.start))
        return [], ran

    # Figures.

    def figures(self, made: Made, ran: Sequence[Made], outputs: float) -> Executed:
        """Return what was executed in figures."""
        places, _ = self.targets(self.runs if self.placement.missing else 0)
        found = 1e3 * np.array([position(move.target) for move in (made.start, *made.path)])
        planned, spot = np.diff(self.orders.times), np.array([move.seconds > 0.0 for move in made.path])
        off, clocked = (np.where(spot, 0.0, each - planned) for each in (self._timed(made), durations(made)))
        runs = self.orders.runs[1:]
        sums = [np.bincount(runs, weights=each) for each in (clocked, planned)]
        shares = np.abs(sums[0]) / np.where(sums[1] > 0.0, sums[1], np.inf)
        lines = self.script.lines
        done: set[int] = set()
        for each in ran:
            done |= each.log.lines
        left = tuple(sorted(lines - done))
        return Executed(
            tuple(each.name for each in ran),
            len(lines),
            len(lines) - len(left),
            (NotExecuted(FILE, left, _ELSE),) if left else (),
            float(np.linalg.norm(found - places, axis=1).max()),
            float(np.abs(off).max(initial=0.0)),
            float(shares.max(initial=0.0)),
            outputs,
            _NOT_KNOWN,
        )


def _beyond(executed: Executed) -> Iterator[VerificationError]:
    """Yield what takes longer or shorter than allowed: a valve that is open longer deposits more."""
    if executed.move_time > MOST_MOVE_TIME:
        what = f"a move takes {executed.move_time:.4f} s more or less than planned, allowed are {MOST_MOVE_TIME:g} s"
        yield refusal(FILE, 1, what)
    if executed.run_time > MOST_RUN_TIME:
        what = f"the moves of a run take {percent(executed.run_time, 1)} of their planned time more or less"
        yield refusal(FILE, 1, f"{what}, allowed are {percent(MOST_RUN_TIME)}")


def _verbs(spot: BoolArray) -> list[str]:
    """Return the kind of move to each target, by whether it has no way."""
    return ["movej", *("movel" if each else "movep" for each in spot[1:].tolist())]


def _flat(values: Sequence[object]) -> list[float]:
    found: list[float] = []
    for value in values:
        some = cast("list[object]", value) if isinstance(value, list) else [value]
        found += [float(each) if isinstance(each, (int, float)) else math.nan for each in some]
    return found
