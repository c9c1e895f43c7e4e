"""How long does the whole take, beside an earlier commit and beside peers? Clock, processor time and memory in one run.

    python -m benchmarks.whole [--before COMMIT] [--repeats N] [--only WORD ...] [--smoke]

The first table runs each piece of work in a process of its own, in turn with this tree and with the commit, so that
what else the machine does falls on both; the least of the repeats counts. The commit is laid out in a folder that is
removed at the end, and what is compiled there is kept as long. Large parts are made beside it: a sphere of 1.3 million
faces, and a cap 30 mm in radius. Processor time is that of the process with all that it
starts; memory is its peak, or that of the largest it starts. 'first run' compiles every kernel anew.

The second table is of peers that are installed (potpourri3d, libigl, toppra, pinocchio), at rising sizes, with the
exponents with which the times grow; those that are missing are named. A new row is a line of WORKS or of PEERS.
"""

from __future__ import annotations

import argparse
import importlib.util
import os
import subprocess
import sys
import tarfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import final

import numpy as np

from benchmarks.parts.surfaces import cap, triangulated
from benchmarks.parts.tables import row, table
from geoprint.model import Surface
from geoprint.surfaces.files import save_ply
from tests.meshes import sphere

TREE = Path(__file__).parents[1]
# The commit before the chain was made faster.
BEFORE = "356c82c"
REPEATS = 3
# A piece of work may print this and its own seconds: of clock, and of the processor; without imports, then.
INNER = "inner seconds:"

_PART = ("data/heart_apex_patch.ply", "--unit", "mm", "--spacing", "1.0", "--body", "data/heart.ply", "--place", "demo")
_SMALL = ("data/plate.ply", "--unit", "mm", "--spacing", "12", "--place", "demo")
# What every piece of inner work begins and ends with: what is compiled at its first call does not count.
_TIMED = """
import time
work(least)
clock, processor = time.perf_counter(), time.process_time()
work(size)
print("inner seconds:", time.perf_counter() - clock, time.process_time() - processor)
"""
_CHAIN = """
from benchmarks.parts.spirals import spiral
from benchmarks.parts.surfaces import make
from geoprint import transforms
from geoprint.config import load_cell
from geoprint.motion.arm import Arm
from geoprint.motion.collision import clearance
from geoprint.motion.controller import controller_path, written_targets
from geoprint.motion.reach import reach
from geoprint.motion.timing import retime
import numpy as np
cell, part, least = load_cell(None), make("cap", faces=20_000), 200
arm = Arm(cell.robot, T_flange_tool=cell.tool.T_flange_tool)
place = transforms.rigid(np.eye(3), cell.demo_position)
def work(count):
    poses = spiral(count, standoff=cell.process.standoff)
    path = reach(poses, arm, T_base_work=place)
    targets = written_targets(path, retime(path, cell.robot, process=cell.process), process=cell.process)
    clearance(controller_path(path, targets, arm), arm, tool=cell.tool, process=cell.process, T_base_work=place,
              poses=path.poses, part=part, body=None, obstacles=cell.obstacles)
"""
_CAP = """
import functools
import numpy as np
from benchmarks.parts.surfaces import cap, triangulated
from geoprint.surfaces import boundary_loops, boundary_seed
least = 1_000
@functools.cache
def cap_of(faces):
    return triangulated(cap(70.0), name="cap", faces=faces, style="irregular")
cap_of(size), cap_of(least)
"""
_DISTANCE = "from geoprint.backends import BACKENDS\ndef work(faces):\n    surface = cap_of(faces)\n"
_OWN_DISTANCE = f"{_CAP}{_DISTANCE}    BACKENDS[backend](surface).distance(boundary_seed(surface))\n"
_POTPOURRI = f"""{_CAP}
import potpourri3d
def work(faces):
    surface = cap_of(faces)
    solver = potpourri3d.MeshHeatMethodDistanceSolver(surface.vertices, surface.faces)
    solver.compute_distance_multisource(np.concatenate(boundary_loops(surface)))
"""
_LIBIGL = f"""{_CAP}
import igl
def work(faces):
    surface = cap_of(faces)
    igl.heat_geodesic(surface.vertices, surface.faces, 1e-2, np.concatenate(boundary_loops(surface)))
"""
_MOTION = """
import numpy as np
least, rng = 200, np.random.default_rng(1)
def joints_of(count):
    turns = np.linspace(0.0, count / 50.0, count)
    return turns * 1e-2, 0.3 * np.column_stack([np.sin(turns * (axis + 1) / 3.0) for axis in range(6)])
"""
_RETIMED = f"""{_MOTION}
import toppra, toppra.algorithm, toppra.constraint
def work(count):
    arcs, joints = joints_of(count)
    limits = np.array([[-4.0, 4.0]] * 6)
    constraint = toppra.constraint
    toppra.algorithm.TOPPRA(
        [constraint.JointVelocityConstraint(limits), constraint.JointAccelerationConstraint(limits * 5.0)],
        toppra.SplineInterpolator(arcs, joints), gridpoints=arcs, solver_wrapper="seidel",
        parametrizer="ParametrizeConstAccel").compute_parameterization(0.0, 0.0)
"""
_OWN_SPEEDS = f"""{_MOTION}
from scipy.interpolate import CubicSpline
from geoprint.motion.timing.path_speeds import problem
from geoprint.motion.timing.strain import GriddedPath
from geoprint.motion.timing.reachability import reachable_speeds
def work(count):
    arcs, joints = joints_of(count)
    path, highest = GriddedPath.of(CubicSpline(arcs, joints), arcs), np.full(count, 4.0)
    reachable_speeds(problem(path, highest=highest, accelerations=np.full(6, 20.0), start=0.0, end=0.0))
"""
_OWN_FORWARD = f"""{_MOTION}
from geoprint.config import load_cell
from geoprint.motion.arm import Arm
cell = load_cell(None)
arm = Arm(cell.robot, T_flange_tool=cell.tool.T_flange_tool)
def work(count):
    arm.tool_poses(joints_of(count)[1])
"""
_FORWARD = f"""{_MOTION}
import pinocchio
from geoprint.motion.arm.urdf import read_urdf
model = pinocchio.buildModelFromXML(read_urdf("irb120"))
data = model.createData()
def work(count):
    for angles in joints_of(count)[1]:
        pinocchio.framesForwardKinematics(model, data, angles)
"""


@final
@dataclass(frozen=True, slots=True)
class Work:
    """A piece of work: arguments of Python, run in a tree; `OUT` is an empty place, and what `PARTS` names a file.

    Attributes:
        name: in the table.
        arguments: of the interpreter.
        small: those of `--smoke`; where there are none, it is left out there.
        fresh: whether what was compiled before is kept from it.
    """

    name: str
    arguments: tuple[str, ...]
    small: tuple[str, ...] = ()
    fresh: bool = False


@final
@dataclass(frozen=True, slots=True)
class Peer:
    """The same work by geoprint and by a peer, as inner work that takes a size.

    Attributes:
        name: of the work.
        library: of the peer.
        own: code that defines `work`.
        code: the peer's.
        sizes: rising.
    """

    name: str
    library: str
    own: str
    code: str
    sizes: tuple[int, ...]


@final
@dataclass(frozen=True, slots=True)
class Cost:
    """What a piece of work took: clock and processor time [s], and peak memory [MB]."""

    clock: float
    processor: float
    memory: float


def _inner(code: str, size: int) -> tuple[str, ...]:
    return "-c", f"size = {size}\n{code}{_TIMED}"


_COMPARE, _PLAN = ("-m", "geoprint", "compare"), ("-m", "geoprint", "plan")
_OUT = ("--out", "OUT")
_PATCH = ("SPHERE", "--unit", "mm", "--at", "0", "0", "40", "--radius", "6", "--spacing", "0.5", "--no-robot")
_CAP_OF_R30 = ("CAP", "--unit", "mm", "--spacing", "0.4", "--place", "demo", "--backends", "heat,lscm,fast-marching")
WORKS = (
    Work("README's comparison", (*_COMPARE, *_PART, *_OUT), small=(*_COMPARE, *_SMALL, *_OUT)),
    Work("plan of the same part", (*_PLAN, *_PART, *_OUT)),
    Work("README's comparison, first run", (*_COMPARE, *_PART, *_OUT), fresh=True),
    Work("inspect a body of 1.3 million faces", ("-m", "geoprint", "inspect", "SPHERE", "--unit", "mm")),
    Work("a patch of 6 mm cut from that, compared", (*_COMPARE, *_PATCH, *_OUT)),
    Work("cap r30 at 0.4 mm, three backends and robot", (*_COMPARE, *_CAP_OF_R30, *_OUT)),
    Work("10k poses to a checked trajectory", _inner(_CHAIN, 10_000), small=_inner(_CHAIN, 400)),
    Work("100k poses to a checked trajectory", _inner(_CHAIN, 100_000)),
)
# Parts that are made when they are first asked for.
PARTS: Mapping[str, Callable[[], Surface]] = {
    "SPHERE": lambda: sphere(radius=40.0, subdivisions=8),
    "CAP": lambda: triangulated(cap(40.0, depth=30.0), name="cap", faces=10_000),
}
_FACES, _POSES = (10_000, 100_000, 1_000_000), (1_000, 10_000, 100_000)
PEERS = (
    Peer("distance, heat", "potpourri3d", f"backend = 'heat'\n{_OWN_DISTANCE}", _POTPOURRI, _FACES),
    Peer("distance, heat", "igl", f"backend = 'heat'\n{_OWN_DISTANCE}", _LIBIGL, _FACES),
    Peer("distance, fast-marching", "potpourri3d", f"backend = 'fast-marching'\n{_OWN_DISTANCE}", _POTPOURRI, _FACES),
    Peer("speeds along a path", "toppra", _OWN_SPEEDS, _RETIMED, _POSES),
    Peer("poses checked, beside timing alone", "toppra", _CHAIN, _RETIMED, _POSES),
    Peer("forward kinematics", "pinocchio", _OWN_FORWARD, _FORWARD, _POSES),
)


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--before", default=BEFORE, metavar="COMMIT", help="to stand beside")
    parser.add_argument("--repeats", type=int, default=REPEATS, help="of each piece of work")
    parser.add_argument("--only", nargs="+", default=(), metavar="WORD", help="rows whose name has one of the words")
    parser.add_argument("--smoke", action="store_true", help="the smallest work, this tree beside itself")
    arguments = parser.parse_args()
    works = [work for work in WORKS if _asked(work.name, arguments.only)]
    peers = [peer for peer in PEERS if _asked(peer.name, arguments.only)]
    with TemporaryDirectory() as folder:
        before = TREE if arguments.smoke else _laid_out(arguments.before, Path(folder, "before"))
        for line in whole(works, before, repeats=1 if arguments.smoke else arguments.repeats, smoke=arguments.smoke):
            print(line, flush=True)
    for line in beside(peers, repeats=1 if arguments.smoke else arguments.repeats, smoke=arguments.smoke):
        print(line, flush=True)


def _asked(name: str, words: Sequence[str]) -> bool:
    return not words or any(word in name for word in words)


def whole(works: Sequence[Work], before: Path, *, repeats: int, smoke: bool) -> Iterator[str]:
    """Yield the table of this tree beside another."""
    heads = [f"{what} {when}" for what in ("clock, s:", "processor, s:", "memory, MB:") for when in ("before", "now")]
    yield from table("work", *heads, "clock now / before", "processor now / before")
    for work in works:
        if smoke and not work.small:
            continue
        arguments = work.small if smoke else work.arguments
        if not work.fresh:
            for tree in (before, TREE):
                cost_of(arguments, tree)  # Compiles.
        pairs = [[cost_of(arguments, tree, fresh=work.fresh) for tree in (before, TREE)] for _ in range(repeats)]
        then, now = (_least([pair[index] for pair in pairs]) for index in (0, 1))
        cells = [f"{value:.2f}" for value in (then.clock, now.clock, then.processor, now.processor)]
        cells += [f"{value:.0f}" for value in (then.memory, now.memory)]
        yield row(work.name, *cells, f"{now.clock / then.clock:.2f}", f"{now.processor / then.processor:.2f}")


def beside(peers: Sequence[Peer], *, repeats: int, smoke: bool) -> Iterator[str]:
    """Yield the table of this tree beside peers."""
    yield from table("work", "size", "geoprint, s", "peer", "s", "geoprint / peer")
    for peer in peers:
        if importlib.util.find_spec(peer.library) is None:
            yield row(peer.name, "-", "-", f"{peer.library} is not installed", "-", "-")
            continue
        sizes = peer.sizes[:1] if smoke else peer.sizes
        times: list[list[float]] = []
        for size in sizes:
            own, other = (
                min(cost_of(_inner(code, size), TREE).clock for _ in range(repeats)) for code in (peer.own, peer.code)
            )
            times.append([own, other])
            yield row(peer.name, str(size), f"{own:.3f}", peer.library, f"{other:.3f}", f"{own / other:.2f}")
        if len(sizes) > 1:
            own, other = np.polyfit(np.log(sizes), np.log(times), 1)[0].tolist()
            yield row(peer.name, "exponent", f"{own:.2f}", peer.library, f"{other:.2f}", "")


def cost_of(arguments: Sequence[str], tree: Path, *, fresh: bool = False) -> Cost:
    """Run a piece of work in a tree and return what it took.

    Raises:
        RuntimeError: it failed; says with what.
    """
    with TemporaryDirectory() as folder:
        environment = os.environ | {"PYTHONPATH": str(tree)} | ({"NUMBA_CACHE_DIR": folder} if fresh else {})
        places = {"OUT": f"{folder}/out"} | {name: str(_made(name)) for name in PARTS if name in arguments}
        command = [sys.executable, *(places.get(each, each) for each in arguments)]
        start, said = os.times(), Path(folder, "said")
        with said.open("wb") as sink:
            process = subprocess.Popen(  # noqa: S603  (commands of this file)
                command, cwd=tree, env=environment, stdout=sink, stderr=subprocess.STDOUT
            )
            _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        text = said.read_text(encoding="utf-8", errors="replace")
    if process.returncode:
        raise RuntimeError(f"{' '.join(command)[:200]} in {tree} ended with {process.returncode}: {text[-2000:]}")
    clock, processor = os.times().elapsed - start.elapsed, used.ru_utime + used.ru_stime
    inner = [line for line in text.splitlines() if line.startswith(INNER)]
    if inner:
        clock, processor = map(float, inner[-1].removeprefix(INNER).split())
    return Cost(clock, processor, used.ru_maxrss / 1024.0)


@cache
def _made(name: str) -> Path:
    """Return a file with a large part, which goes when this process does."""
    path = Path(_folder_of_parts().name, f"{name.lower()}.ply")
    save_ply(PARTS[name](), path)
    return path


@cache
def _folder_of_parts() -> TemporaryDirectory[str]:
    return TemporaryDirectory()


def _least(costs: Sequence[Cost]) -> Cost:
    """Return the least of each that some runs took: the machine is rarely alone."""
    return Cost(*(min(getattr(cost, name) for cost in costs) for name in ("clock", "processor", "memory")))


def _laid_out(commit: str, folder: Path) -> Path:
    """Lay a commit out in a folder."""
    folder.mkdir()
    packed = subprocess.run(  # noqa: S603  (a commit of this tree)
        ["git", "archive", commit],  # noqa: S607
        cwd=TREE,
        capture_output=True,
        check=True,
    )
    with tarfile.open(fileobj=BytesIO(packed.stdout)) as archive:
        archive.extractall(folder, filter="data")
    return folder


if __name__ == "__main__":
    main()
