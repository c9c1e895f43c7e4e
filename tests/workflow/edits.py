"""Edits of written bundles by somebody who makes the manifest's hashes anew."""

from __future__ import annotations

import hashlib
import json
import os
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from geoprint.geometry.files import load, ply_bytes
from geoprint.model import Surface

Edit: TypeAlias = Callable[[Path], None]
# The robot's first part in plan.json.
R = ("robot", 0)


def rehashed(folder: Path) -> None:
    """Write the hashes of all plain files that the manifest lists anew."""
    path = folder / "manifest.json"
    listed = json.loads(path.read_text())
    for name in listed["sha256"]:
        file = folder / name[:200]
        if file.is_file() and not file.is_symlink() and file.stat().st_size < 1e8:
            listed["sha256"][name] = hashlib.sha256(file.read_bytes()).hexdigest()
    path.write_text(json.dumps(listed))


def text(name: str, old: str, new: str) -> Edit:
    def edit(folder: Path) -> None:
        path = folder / name
        content = path.read_text(encoding="latin-1")
        assert old in content, (name, old)
        path.write_text(content.replace(old, new, 1), encoding="latin-1")

    return edit


def matching(name: str, old: str, new: str) -> Edit:
    def edit(folder: Path) -> None:
        path = folder / name
        content = path.read_text(encoding="latin-1")
        assert re.search(old, content), (name, old)
        path.write_text(re.sub(old, new, content, count=1), encoding="latin-1")

    return edit


def key(name: str, *keys: str | int, to: Callable[[Any], object] | list[object] | str | float) -> Edit:
    """Set a value of a JSON file, or change it by a function."""

    def edit(folder: Path) -> None:
        path = folder / name
        whole = json.loads(path.read_text())
        holder = whole
        for each in keys[:-1]:
            holder = holder[each]
        before = holder[keys[-1]]
        holder[keys[-1]] = to(before) if callable(to) else to
        assert holder[keys[-1]] != before, keys
        path.write_text(json.dumps(whole, indent=2) + "\n")

    return edit


def column(name: str, of: str, to: Callable[[str], str], *, where: Callable[[dict[str, str]], bool]) -> Edit:
    """Change a column of the rows of a table that a function chooses."""

    def edit(folder: Path) -> None:
        path = folder / name
        header, *rows = path.read_text().rstrip("\n").split("\n")
        names = header.split(",")
        cells = [dict(zip(names, row.split(","), strict=True)) for row in rows]
        changed = [cell | {of: to(cell[of])} if where(cell) else cell for cell in cells]
        assert changed != cells
        path.write_text("\n".join([header, *(",".join(cell.values()) for cell in changed), ""]))

    return edit


def mesh(name: str, change: Callable[[Surface], Surface]) -> Edit:
    def edit(folder: Path) -> None:
        path = folder / name
        path.write_bytes(ply_bytes(change(load(path, unit="mm"))))

    return edit


def moved(name: str, *shift: float) -> Edit:
    return mesh(name, lambda surface: replace(surface, vertices=surface.vertices + np.array(shift)))


def both(*edits: Edit) -> Edit:
    def edit(folder: Path) -> None:
        for each in edits:
            each(folder)

    return edit


def linked_folder(folder: Path) -> None:
    (folder / "rapid" / "extra").symlink_to("/")


def pipe(folder: Path) -> None:
    (folder / "poses.csv").unlink()
    os.mkfifo(folder / "poses.csv")


def device(folder: Path) -> None:
    (folder / "poses.csv").unlink()
    (folder / "poses.csv").symlink_to("/dev/zero")


def huge(folder: Path) -> None:
    with (folder / "poses.csv").open("r+b") as file:
        file.truncate(4 << 30)


def evil_module(folder: Path) -> None:
    (folder / "part-1" / "rapid" / "Evil.mod").write_text("MODULE Evil\nENDMODULE\n")


def long_name(folder: Path) -> None:
    path = folder / "manifest.json"
    path.write_text(json.dumps({"sha256": json.loads(path.read_text())["sha256"] | {"a" * 5000: "0" * 64}}))


VALVE: dict[str, Edit] = {
    "an output that is 1 at start": text("rapid/controller/EIO.cfg", "-Default 0", "-Default 1"),
    "an output without a safe level": text("rapid/controller/EIO.cfg", ' -SafeLevel "SafetySafeLevel"', ""),
    "an output of another name": text("rapid/controller/EIO.cfg", "doValve", "doValue"),
    "an output twice": text("rapid/controller/EIO.cfg", "doUV", "doValve"),
    "no hook of a stop": matching("rapid/controller/SYS.cfg", r'.*-Shelf "STOP".*\n\n', ""),
    "a hook of another routine": text("rapid/controller/SYS.cfg", "GeoResidentReset", "GeoResidentStarted"),
    "another module at start": text("rapid/controller/SYS.cfg", "HOME:/GeoResident", "HOME:/Other"),
    "a word of the page": text("rapid/controller/first_load.md", "becomes 1", "becomes 0"),
    "the list of modules": text("rapid/GeoPrint.pgf", "GeoGuard.mod", "GeoOther.mod"),
    "a header that checked cables": text("rapid/GeoCell.mod", "  ! Not checked: cables", "  ! Checked: cables"),
    "a header without a doubt": text("rapid/GeoPrint.mod", "  ! Not checked: cables\n", ""),
    "targets in a header": matching("rapid/GeoCell.mod", r"targets: \d+\n", "targets: 7\n"),
    "spacing in a header": text("rapid/GeoPrint.mod", "Spacing: 2.0000", "Spacing: 1.0000"),
    "no obstacles": key("setup.json", "cell", "obstacles", to=[]),
    "clearance of the setup": key("setup.json", "cell", "process", "clearance", to=0.1),
    "limits of a joint": key("setup.json", "cell", "robot", "limits", 0, 0, to=-9.0),
    "layer height of the setup": key("setup.json", "cell", "process", "layer_height", to=1.0),
    "needle of the setup": key("setup.json", "cell", "tool", "needle_diameter", to=0.1),
    "a faster setup": key("setup.json", "cell", "process", "speed", to=25.0),
    "a better calibration": key("setup.json", "surface_within", to=0.001),
    "a larger part": key("setup.json", "extent", 1, 2, to=40.0),
    "misses of touched points": key("setup.json", "placement", "misses", 0, to=0.5),
    "volume": key("plan.json", *R, "motion", "deposited", "share", to=1.02),
    "volume of a run": key("plan.json", *R, "motion", "deposited", "least_run", to=0.9),
    "no warnings": key("plan.json", "warnings", to=[]),
    "deposit doubled": key("plan.json", "paths", "deposit_mm", to=lambda mm: 2.0 * mm),
    "runs": key("plan.json", "paths", "runs", to=5),
    "hash of the program": key("plan.json", *R, "evidence", "program_sha256", to="0" * 64),
    "lines executed": key("plan.json", *R, "evidence", "executed", "lines_executed", to=lambda count: count + 1),
    "motion as executed": key("plan.json", *R, "evidence", "executed", "largest_motion_mm", to=0.0),
    "lines not executed": key("plan.json", *R, "evidence", "executed", "not_executed", to=[]),
    "duration": key("plan.json", *R, "motion", "duration_s", to=1.0),
    "times of material": key("plan.json", *R, "program", "switching", "runs", 0, "material_s", to=[0.1, 0.2]),
    "spacing of the settings": key("plan.json", "settings", "spacing_mm", to=1.0),
    "speed of the settings": key("plan.json", "settings", "speed_mm_s", to=10.0),
    "number of targets": key("plan.json", *R, "program", "targets", to=12),
    "runs dry only": key("plan.json", *R, "program", "dry_run_only", to=True),
    "shortest move": key("plan.json", *R, "motion", "targets", "shortest_ms", to=40.0),
    "where the part stands": key("plan.json", *R, "motion", "T_base_work", 0, 3, to=300.0),
    "flow of the valve": key("plan.json", "deposition", "valve_mm3_s", to=10.0),
    "clearance kept": key("plan.json", *R, "clearance", "kept_mm", to=2.0),
    "cables checked": key("plan.json", *R, "clearance", "checked", to=lambda each: [*each, "cables"]),
    "nothing unchecked": key("plan.json", *R, "clearance", "not_checked", to=[]),
    "area": key("plan.json", "surface", "area_mm2", to=100.0),
    "triangles": key("plan.json", "surface", "refined", "faces", to=100),
    "layer height": key("plan.json", "layers", 0, "height_mm", to=1.0),
    "name of the part": key("plan.json", "input", "name", to="heart.stl"),
    "version": key("plan.json", "version", to="9.9.9"),
    "wrist": key("plan.json", *R, "motion", "smallest_wrist_angle_deg", to=89.0),
    "wrist nearer to straight": key("plan.json", *R, "motion", "smallest_wrist_angle_deg", to=1.0),
    "ceiling of the speed": key("plan.json", *R, "motion", "speed_ceiling_mm_s", to=99.0),
    "surface 2 mm higher": moved("surface.ply", 0.0, 0.0, 2.0),
    "surface 2 mm aside": moved("surface.ply", 2.0, 0.0, 0.0),
    "a triangle less": mesh("surface.ply", lambda surface: replace(surface, faces=surface.faces[:-1])),
    "another part": mesh("part.ply", lambda surface: replace(surface, vertices=1.2 * surface.vertices)),
    "rows that deposit": column("trajectory.csv", "deposit", lambda _: "1", where=lambda row: float(row["t"]) < 0.05),
    "rows of another run": column("trajectory.csv", "run", lambda _: "1", where=lambda row: row["run"] == "0"),
    "flow of poses": column("poses.csv", "flow", lambda flow: f"{0.8 * float(flow):.9f}", where=lambda _: True),
    "level of poses": column("poses.csv", "level", lambda _: "7", where=lambda row: row["level"] == "0"),
    "length along poses": column("poses.csv", "s", lambda s: f"{0.5 * float(s):.6f}", where=lambda _: True),
    "clearance of the cell": matching("cell/cell.toml", r"clearance_mm = \S+", "clearance_mm = 0.1"),
    "spacing of the job": text("job.toml", "spacing = 2.0", "spacing = 3.0"),
    "a job that is a demonstration": text("job.toml", "max_tilt", 'place = "demo"\nmax_tilt'),
    "lean of the job": text("job.toml", "max_tilt = 15.0", "max_tilt = 5.0"),
    "backend of the job": text("job.toml", 'backend = "heat"', 'backend = "lscm"'),
    "a job of another file": text("job.toml", 'surface = "part.ply"', 'surface = "../plate.ply"'),
    "a job of a device": text("job.toml", 'surface = "part.ply"', 'surface = "/dev/zero"'),
    "a linked folder": linked_folder,
    "a pipe": pipe,
    "a device": device,
    "4 GB": huge,
    "a name of 5000 letters": long_name,
}
TABLE: dict[str, Edit] = {
    "may print": both(
        key("plan.json", *R, "program", "dry_run_only", to=False),
        key("plan.json", *R, "motion", "placement_missing", to=[]),
    ),
    "a part that was stated": key("part-1/setup.json", "placement", "calibrated", to=True),
    "surface aside": moved("surface.ply", 2.0, 0.0, 0.0),
    "lean": key("plan.json", "paths", "largest_lean_deg", to=lambda angle: angle + 2.0),
    "time of all attitudes": key("plan.json", "joined", "print_s", to=1.0),
    "scenarios of all attitudes": key("plan.json", "joined", "refused", to=[]),
    "an output of an attitude": text("part-2/rapid/controller/EIO.cfg", "-Default 0", "-Default 1"),
    "an output of all attitudes": text("rapid/controller/EIO.cfg", "-Default 0", "-Default 1"),
    "a module of an attitude": evil_module,
}
STACK: dict[str, Edit] = {
    "volume of a layer": key("stack.json", "layers", 0, "laid_mm3", to=lambda mm3: 1.1 * mm3),
    "volume of all": key("stack.json", "finished", "printed", "volume", to=lambda share: 1.1 * share),
    "clearance": key("stack.json", "layers", 1, "clearance_mm", to=lambda mm: mm + 1.0),
    "bottom": key("stack.json", "layers", 1, "bottom_mm", to=lambda mm: mm + 0.1),
    "height": key("stack.json", "layers", 1, "height_mm", to=lambda mm: mm + 0.1),
    "thickness": key("stack.json", "thickness_mm", to=lambda mm: mm + 0.5),
    "time": key("stack.json", "program", "print_s", to=lambda seconds: seconds / 2.0),
    "scenarios": key("stack.json", "program", "scenarios", to=lambda each: [*each, "flown"]),
    "may print": key("stack.json", "program", "runs_dry_only", to=lambda dry: not dry),
    "warnings": key("stack.json", "layers", 0, "warnings", to=lambda each: [*each, "another"]),
    "part": key("stack.json", "part", to="other.ply"),
    "an output": text("rapid/controller/EIO.cfg", "-Default 0", "-Default 1"),
    "a header": matching("rapid/GeoStack.mod", r"! Part: \S+", "! Part: other.ply"),
    "surface of a layer": moved("layer-02/surface.ply", 0.0, 0.0, 2.0),
}
# What is found by planning again alone.
FULL: dict[str, Edit] = {
    "evenness": key("plan.json", "uniformity", "thickness", "cv", to=0.001),
    "distance": key("plan.json", "uniformity", "distance", "mean", to=0.0),
    "expected print": key("plan.json", "uniformity", "printed", "cv", to=0.001),
    "clearance": key("plan.json", *R, "clearance", "smallest_mm", to=9.0),
    "places looked at": key("plan.json", *R, "clearance", "checks", to=99999),
    "slope": key("plan.json", "field", "mean_slope_error", to=0.0),
    "jerk": key("plan.json", *R, "motion", "largest_jerk_m_s3", to=1.0),
    "bends": key("plan.json", *R, "motion", "targets", "bends", to=[]),
    "notes": key("plan.json", "notes", to=[]),
    "preparation": key("plan.json", "surface", "preparation", "flipped_faces", to=9),
}
