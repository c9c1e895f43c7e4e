"""A part for the report that is quick to make: a dome with rings on it, planned by backends that never ran."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from geoprint.model import FloatArray, IntArray, Surface
from geoprint.reporting import (
    GAP,
    OVERLAP,
    BackendView,
    Body,
    Machine,
    MotionShades,
    PartReport,
    PathDistances,
    Picture,
    Replay,
    Row,
    TableReplay,
)

RADIUS, HEIGHT = 20.0, 6.0
SPACING = 2.0
# Foot of the post that carries the arm [mm], and the share of the time before and after printing.
POST, APPROACH_SHARE = (-60.0, 0.0, 0.0), 0.05
# A whole PNG of one grey pixel.
PIXEL = bytes.fromhex(
    "89504e470d0a1a0a0000000d49484452000000010000000108000000003a7e9b"
    "550000000a49444154789c636800000082008177cd72b60000000049454e44ae426082"
)


def height(radii: FloatArray) -> FloatArray:
    return HEIGHT * (1.0 - (radii / RADIUS) ** 2)


def dome(*, rings: int = 24, name: str = "dome") -> Surface:
    """Return a paraboloid of 6 * rings^2 faces, counter-clockwise seen from above."""
    counts = np.concatenate([[1], 6 * np.arange(1, rings + 1)])
    starts = np.concatenate([[0], np.cumsum(counts)])
    radii = np.repeat(np.arange(rings + 1), counts) * RADIUS / rings
    within = np.arange(len(radii)) - np.repeat(starts[:-1], counts)
    angles = 2 * np.pi * within / np.repeat(counts, counts)
    faces: list[tuple[int, int, int]] = []
    for ring in range(1, rings + 1):
        inner, outer = int(counts[ring - 1]), int(counts[ring])
        for sector in range(6):
            for step in range(ring):
                a = starts[ring] + (sector * ring + step) % outer
                b = starts[ring] + (sector * ring + step + 1) % outer
                c = starts[ring - 1] + (sector * (ring - 1) + step) % inner
                faces.append((a, b, c))
                if step < ring - 1:
                    faces.append((b, starts[ring - 1] + (sector * (ring - 1) + step + 1) % inner, c))
    vertices = np.column_stack([radii * np.cos(angles), radii * np.sin(angles), height(radii)])
    return Surface(vertices, np.array(faces), name=name)


def circles(radii: Sequence[float], *, points: int = 120) -> tuple[FloatArray, IntArray]:
    """Return closed circles on the dome, and where each starts."""
    angles: FloatArray = np.linspace(0.0, 2 * np.pi, points)
    lines = [
        np.column_stack([r * np.cos(angles), r * np.sin(angles), np.full(points, height(np.array([r]))[0])])
        for r in radii
    ]
    return np.vstack(lines), points * np.arange(len(lines) + 1)


def box(low: Sequence[float], high: Sequence[float]) -> Surface:
    corners = np.array([[(low, high)[(i >> axis) & 1][axis] for axis in range(3)] for i in range(8)], dtype=np.float64)
    sides = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    return Surface(corners, np.array([face for a, b, c, d in sides for face in ((a, b, c), (a, c, d))]))


def machine() -> Machine:
    """Return a post beside the dome that turns about its axis, an arm that it carries and that nods, and a table."""
    return Machine(
        points=np.array([POST, [POST[0], POST[1], 50.0]]),
        directions=np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0]]),
        bodies=(
            Body("arm", 0, box([-70.0, -10.0, -20.0], [-50.0, 10.0, 40.0])),
            Body("arm", 1, box([-66.0, -6.0, 40.0], [10.0, 6.0, 56.0])),
            Body("tool", 2, box([-2.0, -2.0, 10.0], [2.0, 2.0, 40.0])),
            Body("cell", 0, box([-100.0, -60.0, -30.0], [60.0, 60.0, -22.0])),
        ),
    )


def replay(*, frames: int = 80, seconds: float = 40.0) -> Replay:
    """Return a motion from a quarter turn of the post to none, while circles are laid on the dome."""
    bead, offsets = circles([19.0, 15.0, 11.0, 7.0, 3.0])
    times: FloatArray = np.linspace(0.0, seconds, frames)
    approach = seconds * APPROACH_SHARE
    bead_times: FloatArray = np.linspace(approach, seconds - approach, len(bead))
    return Replay(
        times=times,
        joints=np.column_stack([np.linspace(np.pi / 2, 0.0, frames), np.zeros(frames)]),
        speeds=np.full(frames, 20.0),
        valve=np.column_stack([bead_times[offsets[:-1]], bead_times[offsets[1:] - 1]]),
        lamp=np.array([[approach, seconds - approach]]),
        bead=bead,
        bead_offsets=offsets,
        bead_times=bead_times,
    )


def tilting_part(*, seconds: float) -> PartReport:
    """Return the dome on a block that takes two attitudes: a quarter turn about the x axis, then 30 mm up.

    On its course to each it has one frame: an eighth of a turn, then back with the lift half done.
    """
    one = part(surface=dome(rings=12), names=("only",), seconds=seconds)
    quarter = [[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, -1.0, 0.0], [0.0, 1.0, 0.0, 0.0]]
    half = np.sqrt(0.5)
    eighth = [[1.0, 0.0, 0.0, 0.0], [0.0, half, -half, 0.0], [0.0, half, half, 0.0]]
    rest, up = np.eye(4)[:3].tolist(), np.eye(4)[:2].tolist()
    lifts = [[*up, [0.0, 0.0, 1.0, height]] for height in (15.0, 30.0)]
    motions = np.array([rest, eighth, quarter, quarter, *lifts])
    turning = np.array([[0.0, 0.1 * seconds], [0.5 * seconds, 0.6 * seconds]])
    times = seconds * np.array([0.0, 0.05, 0.1, 0.5, 0.55, 0.6])
    moving = replace(replay(seconds=seconds), table=TableReplay(turning, times, motions, motions[:, None]))
    assert one.machine is not None
    block = Body("table", 1, box([-15.0, -15.0, -20.0], [15.0, 15.0, -10.0]))
    machine = replace(one.machine, bodies=(*one.machine.bodies, block))
    return replace(one, machine=machine, backends=(replace(one.backends[0], replay=moving),))


def backend(name: str, *, surface: Surface, error: float, moving: bool = True, seconds: float = 40.0) -> BackendView:
    """Return a backend whose spacing is wrong by `error` in the middle of the dome and right at its rim."""
    radii = np.hypot(*surface.vertices[:, :2].T)
    places, offsets = circles([19.0, 17.0, 15.0, 13.0, 11.0, 9.0, 7.0, 5.0, 3.0, 1.0])
    ratios = 1.0 + error * (1.0 - np.hypot(*places[:, :2].T) / RADIUS)
    ratios[: offsets[1]] = np.nan
    on_surface = np.where(radii > 18.0, np.nan, 1.0 + error * (1.0 - radii / RADIUS))
    return BackendView(
        name=name,
        title=f"{name}, in words",
        distance=RADIUS - radii,
        spacing_ratios=on_surface,
        coverage=np.where(radii < 30 * error, GAP, np.where(radii > 19.0, OVERLAP, 0)),
        places=places,
        offsets=offsets,
        ratios=ratios,
        widths=np.full(len(places), 2.0),
        still=Picture(f"Paths of {name}", "png", PIXEL),
        replay=replay(seconds=seconds) if moving else None,
        shades=MotionShades(8.0 * radii / RADIUS, 1.0 - 0.5 * radii / RADIUS) if moving else None,
    )


def part(
    name: str = "dome.ply",
    *,
    surface: Surface | None = None,
    names: Sequence[str] = ("first", "second"),
    seconds: float = 40.0,
) -> PartReport:
    """Return a report on the dome; the last backend cannot be printed."""
    shown = surface or dome()
    views = tuple(
        backend(
            each, surface=shown, error=0.3 / 4**place, moving=place < len(names) - 1 or len(names) == 1, seconds=seconds
        )
        for place, each in enumerate(names)
    )
    apart = 0.1 * np.abs(np.subtract.outer(np.arange(len(names)), np.arange(len(names))))
    return PartReport(
        name=name,
        verdict=(f"{names[0]} covers {name} best.", f"{names[0]} can be printed."),
        cautions=("PLACEMENT UNKNOWN: programs only run dry.",),
        overview=(("most even", names[0]),),
        surface=shown,
        R_view_work=np.eye(3),
        spacing=SPACING,
        machine=machine(),
        winner=0,
        critical_deg=30.0,
        backends=views,
        refused=(("third", "the surface has no border."),),
        table=(
            Row("Evenness", "spacing CV", "0 % is even", tuple("1.0 %" for _ in names), (0,), decides=True),
            Row("Robot", "print time [s]", "", tuple("40" for _ in names)),
        ),
        path_distances=PathDistances(tuple(names), 2 * apart, apart),
        pictures=(Picture("the chart", "svg", b'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 2 1"/>'),),
        settings=(("spacing", "2 mm"),),
        inputs=((name, 64 * "0"),),
    )
