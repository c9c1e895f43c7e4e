"""What is timed: pieces of work by this tree and an earlier one, and the same work by peers at rising sizes.

Code is run in processes of its own: inner work is a function `work(size)`, and `least` the size at which it compiles.
A new row is a line of WORKS or of PEERS.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

from benchmarks.whole.costs import INNER
from tests.shared_data import SHARED_DATA

_PART = ("data/heart_apex_patch.ply", "--unit", "mm", "--spacing", "1.0", "--body", "data/heart.ply", "--place", "demo")
_SMALL = ("data/plate.ply", "--unit", "mm", "--spacing", "12", "--no-robot")
# What every piece of inner work begins and ends with: what is compiled at its first call does not count. Where the peak
# of the memory cannot be set back, it is that of all that the process did.
_TIMED = f"""
import contextlib, time
def resident(key):
    with open("/proc/self/status") as status:
        return next(int(line.split()[1]) for line in status if line.startswith(key)) / 1024
work(least)
resident_before = resident("VmRSS")
with contextlib.suppress(OSError), open("/proc/self/clear_refs", "w") as peak:
    peak.write("5")
clock, processor = time.perf_counter(), time.process_time()
work(size)
print("{INNER}", time.perf_counter() - clock, time.process_time() - processor, resident("VmHWM") - resident_before)
"""
_CHAIN = """
from benchmarks.parts.streams import spiral
from benchmarks.parts.surfaces import make
from geoprint import transforms
from geoprint.config import load_cell
from geoprint.robot.arm import Arm
from geoprint.robot.collision import clearance
from geoprint.robot.controller import controller_path, written_targets
from geoprint.robot.reach import reach
from geoprint.robot.timing import retime
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
_WARM = """
from geoprint import compare, job_of
least = size
def work(spacing):
    compare(job_of(surface=part, unit="mm", spacing=spacing, place="demo", robot=robot))
"""
_CAP = """
import numpy as np
from benchmarks.whole.costs import cap_of
from geoprint.geometry import boundary_loops, boundary_source
least = 1_000
cap_of(size), cap_of(least)
"""
_DISTANCE = "from geoprint.distance import BACKENDS\ndef work(faces):\n    surface = cap_of(faces)\n"
_OWN_DISTANCE = f"{_CAP}{_DISTANCE}    BACKENDS[backend](surface).distance(boundary_source(surface))\n"
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
    data = igl.HeatGeodesicsData()
    igl.heat_geodesics_precompute(surface.vertices, surface.faces, data)
    igl.heat_geodesics_solve(data, np.concatenate(boundary_loops(surface)))
"""
_FLOWER = """
import numpy as np
from benchmarks.whole.costs import LEVELS, flower
least, border = 64, flower()
"""
_OWN_LEVELS = f"""{_FLOWER}
from geoprint.distance.lscm_raster import region_image
spacing = float(region_image(border, resolution=512).values.max()) / LEVELS
def work(pixels):
    region_image(border, resolution=pixels).contours((np.arange(LEVELS) + 0.5) * spacing)
"""
_TRANSFORMED = f"""{_FLOWER}
import contourpy
from scipy.ndimage import distance_transform_edt
from geoprint.distance.lscm_raster import region_image
masks = {{pixels: region_image(border, resolution=pixels).values > 0.0 for pixels in (least, size)}}
def work(pixels):
    values = distance_transform_edt(masks[pixels])
    traced = contourpy.contour_generator(z=values)
    for level in (np.arange(LEVELS) + 0.5) * values.max() / LEVELS:
        traced.lines(level)
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
from geoprint.robot.timing.topp import problem
from geoprint.robot.timing.topp import GriddedPath
from geoprint.robot.timing.reachability import reachable_speeds
def work(count):
    arcs, joints = joints_of(count)
    path, highest = GriddedPath.of(CubicSpline(arcs, joints), arcs), np.full(count, 4.0)
    reachable_speeds(problem(path, highest=highest, accelerations=np.full(6, 20.0), start=0.0, end=0.0))
"""
_OWN_FORWARD = f"""{_MOTION}
from geoprint.config import load_cell
from geoprint.robot.arm import Arm
cell = load_cell(None)
arm = Arm(cell.robot, T_flange_tool=cell.tool.T_flange_tool)
def work(count):
    arm.tool_poses(joints_of(count)[1])
"""
_FORWARD = f"""{_MOTION}
import pinocchio
from geoprint.robot.arm.urdf import read_urdf
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
        library: of the peer; several joined by " + ".
        own: code that defines `work`.
        code: the peer's.
        sizes: rising.
    """

    name: str
    library: str
    own: str
    code: str
    sizes: tuple[int, ...]


def inner(code: str, size: int) -> tuple[str, ...]:
    """Return the arguments with which an interpreter times `work(size)`."""
    return "-c", f"size = {size}\n{code}{_TIMED}"


_COMPARE, _PLAN = ("-m", "geoprint", "compare"), ("-m", "geoprint", "plan")
_OUT = ("--out", "OUT")
_PATCH = ("SPHERE", "--unit", "mm", "--at", "0", "0", "40", "--radius", "6", "--spacing", "0.5", "--no-robot")
_CAP_OF_R30 = ("CAP", "--unit", "mm", "--spacing", "0.4", "--place", "demo", "--backend", "heat,lscm,fast-marching")
_R20, _RECTANGLE = (str(SHARED_DATA / "patches" / f"lv_{name}.ply") for name in ("apex_disc_r20", "lateral_rect_40x30"))
_AT_1MM = ("--unit", "mm", "--spacing", "1")


def _warm(part: str, *, robot: bool) -> tuple[str, ...]:
    """Return the arguments that time a comparison of a part at 1 mm after one that has called everything."""
    return inner(f"part, robot = {part!r}, {robot}\n{_WARM}", 1)


WORKS = (
    Work("README's comparison", (*_COMPARE, *_PART, *_OUT)),
    Work("plan of the same part", (*_PLAN, *_PART, *_OUT), small=(*_PLAN, *_SMALL, *_OUT)),
    Work("README's comparison, first run", (*_COMPARE, *_PART, *_OUT), fresh=True),
    Work("inspect a body of 1.3 million faces", ("-m", "geoprint", "inspect", "SPHERE", "--unit", "mm")),
    Work("a patch of 6 mm cut from that, compared", (*_COMPARE, *_PATCH, *_OUT)),
    Work("cap r30 at 0.4 mm, three backends and robot", (*_COMPARE, *_CAP_OF_R30, *_OUT)),
    Work("warm r20", _warm(_R20, robot=False)),
    Work("warm r20, robot", _warm(_R20, robot=True)),
    Work("command r20", (*_COMPARE, _R20, *_AT_1MM, "--no-robot", *_OUT)),
    Work("warm rectangle", _warm(_RECTANGLE, robot=False)),
    Work("warm rectangle, robot", _warm(_RECTANGLE, robot=True)),
    Work("command rectangle", (*_COMPARE, _RECTANGLE, *_AT_1MM, "--no-robot", *_OUT)),
    Work("10k poses to a checked trajectory", inner(_CHAIN, 10_000)),
    Work("100k poses to a checked trajectory", inner(_CHAIN, 100_000)),
)
_FACES, _POSES = (10_000, 100_000, 1_000_000), (1_000, 10_000, 100_000)
_PIXELS = (1_024, 2_048, 4_096, 8_192)
PEERS = (
    Peer("distance, heat", "potpourri3d", f"backend = 'heat'\n{_OWN_DISTANCE}", _POTPOURRI, _FACES),
    Peer("distance, heat", "igl", f"backend = 'heat'\n{_OWN_DISTANCE}", _LIBIGL, _FACES),
    Peer("distance, fast-marching", "potpourri3d", f"backend = 'fast-marching'\n{_OWN_DISTANCE}", _POTPOURRI, _FACES),
    Peer("levels of an image", "scipy + contourpy", _OWN_LEVELS, _TRANSFORMED, _PIXELS),
    Peer("speeds along a path", "toppra", _OWN_SPEEDS, _RETIMED, _POSES),
    Peer("poses checked, beside timing alone", "toppra", _CHAIN, _RETIMED, _POSES),
    Peer("forward kinematics", "pinocchio", _OWN_FORWARD, _FORWARD, _POSES),
)
