"""A simulated print of a bundle: what its program deposits as it stands there, beside what its paths ask for."""

from __future__ import annotations

from pathlib import Path
from typing import final

import numpy as np

from geoprint.errors import percent
from geoprint.geometry import mean_normal
from geoprint.inspection.camera import Lens
from geoprint.inspection.executing import DepositedPieces, deposited_pieces, deposited_steps
from geoprint.inspection.inputs import PlannedPrint, lens_text, read_plan
from geoprint.inspection.text import grid
from geoprint.model import FloatArray, IntArray, Surface, freeze_arrays, frozen
from geoprint.postprocessor import PLAN
from geoprint.reporting import PlanRecord, read_record
from geoprint.reporting.records.inspection import SimulatedRecord, SimulatedRunRecord
from geoprint.reporting.records.rounding import save_record, stamp
from geoprint.simulation import (
    DepositedBeads,
    Development,
    Faults,
    Lighting,
    Sensor,
    Viewpoint,
    looking_at,
    pictured,
    png,
    scanned,
)
from geoprint.workflow.saving import written

# What a person reads of a simulated print: what lies along each run, beside what its path asks for.


COLUMNS = ("run", "wanted mm3", "deposited mm3", "deposited / wanted", "beside mm3", "longest bare mm")


def simulated_text(record: SimulatedRecord) -> str:
    """Return a table of the runs, and how the print was deposited."""
    rows = [
        [
            str(each.run + 1), f"{each.wanted_mm3:.2f}", f"{each.laid_mm3:.2f}",
            f"{each.laid_mm3 / each.wanted_mm3:.3f}",
            f"{each.beside_mm3:.2f}", f"{each.longest_bare_mm:.2f}",
        ]
        for each in record.runs
    ]  # fmt: skip
    share = record.laid_mm3 / record.wanted_mm3
    by = (
        "by its program, executed from the folder with the delays of its cell"
        if record.laid_by == "program"
        else "by its paths, without a program"
    )
    put_in = (
        f"put in: flow x {record.flow:g}, width of beads x {record.spread:g} +/- "
        f"{percent(record.width_noise, 1)}, {record.offset_mm:+g} mm to the left; seed {record.seed}"
    )
    return "\n".join(
        [
            *grid(COLUMNS, rows),
            "",
            f"{record.plan}: {record.laid_mm3:.1f} mm3 deposited in simulation, {share:.3f} of the planned, {by}",
            put_in,
        ]
    )


# A simulated print of a bundle: what its program deposits as it stands there, or its paths where it has none.


# Of the scan [mm, share], and pixels along a side of scan and photograph.
NOISE, MISSING = 0.05, 0.3
SCAN_PIXELS, PHOTOGRAPH_PIXELS = 260, 900
# How far away camera and scanner are, in radii of the part, and how much of the picture it fills.
AWAY_RADII, FILLED = 10.0, 0.8


@final
@frozen
class SimulatedPrint:
    """What a bundle deposits in simulation.

    Attributes:
        plan: the bundle.
        executed: whether its program was executed; else its paths were deposited.
        beads: what lies on the part.
        faults: what was put in besides.
        seed: of the noise.
        runs: (r,) runs of the plan that deposit material.
        wanted: (r,) volume that its paths ask for [mm3].
        deposited: (r,) volume that lies along each [mm3].
        beside: (r,) of that, what lies farther than half a spacing before the run's beginning, or behind its end
            [mm3].
        bare: (r,) longest stretch of each without material [mm].
        development: what the camera that pictures it makes of the light; as by default if None.
    """

    plan: PlannedPrint
    executed: bool
    beads: DepositedBeads
    faults: Faults
    seed: int
    runs: IntArray
    wanted: FloatArray
    deposited: FloatArray
    beside: FloatArray
    bare: FloatArray
    development: Development | None = None

    def __post_init__(self) -> None:
        freeze_arrays(
            self, runs="int: r", wanted="float: r", deposited="float: r", beside="float: r", bare="float: r"
        )  # fmt: skip


def simulated_print(
    folder: Path | str, *, faults: Faults, seed: int, development: Development | None = None
) -> SimulatedPrint:
    """Simulate the print of a bundle.

    Its program is executed as it stands in the folder, whoever has edited it since, and even if `geoprint check` would
    refuse it: to see what it deposits. Over a table those of all attitudes are.

    Args:
        folder: a bundle of one plan.
        faults: what goes wrong besides.
        seed: of the noise.
        development: what the camera that pictures it makes of the light; as by default if None.

    Raises:
        InputError: the folder is no bundle, or nothing is deposited.
        UsageError: as `deposited_pieces`.
        VerificationError: a table was changed, or as `deposited_pieces`.
    """
    folder = Path(folder)
    plan, record = read_plan(folder), read_record(folder / PLAN, PlanRecord)
    deposited = deposited_pieces(folder, plan, record, faults=faults, random=np.random.default_rng(seed))
    sums = _summed(plan, deposited)
    return SimulatedPrint(plan, bool(record.robot), deposited.beads, faults, seed, *sums, development)


def _summed(
    plan: PlannedPrint, deposited: DepositedPieces
) -> tuple[IntArray, FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return run, wanted, deposited, beside and bare of a simulated print."""
    poses, beads, margin = plan.poses, deposited.beads, 0.5 * plan.spacing
    runs = np.unique(poses.runs[poses.deposit])
    steps = deposited_steps(poses)
    flows = (poses.flow[1:] + poses.flow[:-1]) / 2.0
    piece = np.where(deposited.within, beads.runs, 0)
    whose, lengths = np.where(deposited.within, deposited.runs[piece], -1), deposited.lengths[piece]
    within = (beads.arcs >= 0.0) & (beads.arcs <= lengths) & (beads.widths > 0.0)
    off = (beads.arcs < -margin) | (beads.arcs > lengths + margin)
    sums, volumes = np.zeros((4, runs.size)), beads.volumes
    for row, run in enumerate(runs.tolist()):
        own, there = poses.runs[1:] == run, whose == run
        filled = np.sort((beads.arcs + deposited.starts[piece])[there & within])
        bare = np.diff(np.concatenate([[0.0], filled, [float(steps[own].sum())]])).max()
        sums[:, row] = (
            float((steps * flows)[own].sum()), float(volumes[there].sum()), float(volumes[there & off].sum()), bare,
        )  # fmt: skip
    return runs, sums[0], sums[1], sums[2], sums[3]


def record_simulated(found: SimulatedPrint) -> SimulatedRecord:
    """Return what simulated.json says of a simulated print: the source of its text."""
    faults = found.faults
    return SimulatedRecord(
        **stamp(SimulatedRecord),
        plan=found.plan.name,
        laid_by="program" if found.executed else "paths",
        flow=faults.flow,
        spread=faults.width_scale,
        width_noise=faults.width_noise,
        offset_mm=faults.offset,
        seed=found.seed,
        wanted_mm3=float(found.wanted.sum()),
        laid_mm3=float(found.beads.volumes.sum()),
        runs=tuple(
            SimulatedRunRecord(run=run, wanted_mm3=wanted, laid_mm3=deposited, beside_mm3=beside, longest_bare_mm=bare)
            for run, wanted, deposited, beside, bare in zip(
                found.runs.tolist(), found.wanted.tolist(), found.deposited.tolist(), found.beside.tolist(),
                found.bare.tolist(), strict=True,
            )
        ),
    )  # fmt: skip


@written.register
def _save(found: SimulatedPrint, directory: Path | str, *, overwrite: bool) -> SimulatedRecord:
    """Write simulated.json, and a scan and a photograph to be appraised, with fiducials and lens.

    The scan has 0.05 mm noise and 30 % missing, in the part's coordinates; both are taken from above the part.

    Raises:
        InputError: the part is not seen from above.
    """
    record, surface = record_simulated(found), found.plan.surface
    random = np.random.default_rng([found.seed, 1])
    up = mean_normal(surface)
    scan = scanned(
        surface, found.beads, Sensor(_above(surface, up, SCAN_PIXELS), NOISE, MISSING), T_work_scan=np.eye(4),
        random=random,
    )  # fmt: skip
    view = _above(surface, up, PHOTOGRAPH_PIXELS)
    grey = pictured(surface, found.beads, view, Lighting(up), found.development, random=random)
    files = {
        "simulated.txt": f"{simulated_text(record)}\n".encode(),
        "scan.xyz": "".join(f"{x:.4f} {y:.4f} {z:.4f}\n" for x, y, z in scan.points.tolist()).encode(),
        "print.png": png(grey),
        "marks.csv": _marks(scan.feet, view),
        "lens.toml": lens_text(Lens(view.size, np.full(2, view.focal), view.middle, np.zeros(2))).encode(),
    }
    return save_record(record, "simulated.json", files, directory, overwrite=overwrite)


def _above(surface: Surface, up: FloatArray, pixels: int) -> Viewpoint:
    """Return a camera far above the middle of a part, which fills most of a square picture."""
    middle = 0.5 * (surface.vertices.min(axis=0) + surface.vertices.max(axis=0))
    radius = float(np.linalg.norm(surface.vertices - middle, axis=1).max())
    away = AWAY_RADII * radius
    focal = FILLED * 0.5 * pixels * away / radius
    return looking_at(middle, place=middle + away * up, focal=focal, size=(pixels, pixels))


def _marks(feet: FloatArray, view: Viewpoint) -> bytes:
    """Return a table of fiducials: the places seen that are outermost in eight directions, and the middle one."""
    seen = view.pixels(feet) - view.middle
    angles = np.pi * np.arange(8) / 4.0
    rows = [int((seen @ np.array([np.cos(angle), np.sin(angle)])).argmax()) for angle in angles]
    places = feet[sorted({*rows, int(np.linalg.norm(seen, axis=1).argmin())})]
    lines = [
        f"m{number},{u:.3f},{v:.3f},{x:.4f},{y:.4f},{z:.4f}"
        for number, ((u, v), (x, y, z)) in enumerate(zip(view.pixels(places), places, strict=True), start=1)
    ]
    return "\n".join(["name,u,v,x,y,z", *lines, ""]).encode()
