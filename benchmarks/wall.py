"""Do layers through a ventricle's wall have the fibres of the rule, and do carried fields keep what they have below?

    python -m benchmarks.wall [LABELS] [--wall N ...] [--cavity N] [--base N ...] [--at X Y Z] [--radius MM]
                              [--height MM] [--spacing MM] [--picture FILE] [--smoke]

The first table is of fields carried by formula, on levels at three heights: what their lines are off, and how many
singularities there are, face by face around all vertices, and were to be. The second is of a patch of the cavity in a
label volume (NIfTI, voxels of a byte), from which layers go to the outside of the wall. The rule is solved once more,
by linear tetrahedra that share no code with geoprint. Of each layer: the helix angle by that rule and of its strokes,
by how much these are off the rule's lines in space, and off what of these lies within the layer; how many start,
the variation of the thickness with a constant flow, and the share of the area that is covered once. Without a volume
the wall is that of a hollow ball. `--picture` draws three of the layers, and the angles through the wall.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from benchmarks.guide.through import HEART, through_picture
from benchmarks.parts.tables import row, table
from benchmarks.parts.wall_layers import Strokes, Ventricle, layers_through
from geoprint.account.metrics import COVERED_ONCE, THICKNESS
from geoprint.fields import AlongRim, DirectionField, HelixRule, carried_field, prescribed_field, singularities_near
from geoprint.layers import level_surface
from geoprint.model import BoolArray, FloatArray, Surface
from geoprint.surfaces import closest
from tests.fields.hollow_ball import ball_voxels
from tests.fields.measures import off
from tests.fields.tetrahedra import solved
from tests.meshes import cylinder_patch, disc, spherical_cap
from tests.surfaces.files.volumes import save_nifti

HEIGHTS = (1.0, 4.0, 10.0)
# Nearer to a singularity [mm] lines turn within a face.
NEAR = 5.0


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("labels", type=Path, nargs="?", metavar="LABELS")
    parser.add_argument("--wall", type=int, nargs="+", default=list(HEART.wall), metavar="N")
    parser.add_argument("--cavity", type=int, default=HEART.cavity, metavar="N")
    parser.add_argument("--base", type=int, nargs="+", default=list(HEART.base), metavar="N")
    parser.add_argument("--at", type=float, nargs=3, default=list(HEART.at), metavar=("X", "Y", "Z"), help="[mm]")
    parser.add_argument("--radius", type=float, default=HEART.radius, metavar="MM", help="of the patch")
    parser.add_argument("--height", type=float, default=1.3, metavar="MM", help="of a layer")
    parser.add_argument("--spacing", type=float, default=1.5, metavar="MM")
    parser.add_argument("--picture", type=Path, metavar="FILE", help="of layers and angles (.png)")
    parser.add_argument("--smoke", action="store_true", help="one height, and two layers of the ball")
    asked = parser.parse_args()
    for line in _carried(HEIGHTS[:1] if asked.smoke else HEIGHTS):
        print(line, flush=True)
    with tempfile.TemporaryDirectory() as folder:
        one = Ventricle(
            asked.labels, tuple(asked.wall), asked.cavity, tuple(asked.base), tuple(asked.at), asked.radius
        )  # fmt: skip
        if asked.labels is None:
            one = _ball(Path(folder))
        height, spacing = (4.5, 4.0) if asked.smoke else (asked.height, asked.spacing)
        layers = _through(one, Path(folder), height=height, spacing=spacing)
    if asked.picture is not None:
        asked.picture.write_bytes(through_picture(layers))


def _ball(folder: Path) -> Ventricle:
    """Return a wall whose cavity has a radius of 15 mm, and whose outside one of 25 mm, cut off by its base."""
    voxels, path = ball_voxels(), folder / "ball.nii.gz"
    labels = np.where(voxels.wall, 1, np.where(voxels.cavity, 2, np.where(voxels.base, 3, 0)))
    save_nifti(path, labels.astype(np.uint8), voxels.affine)
    return Ventricle(path, (1,), 2, (3,), (14.0, 0.0, -5.0), 8.0)


def _through(one: Ventricle, folder: Path, *, height: float, spacing: float) -> list[Strokes]:
    """Print the table of layers through a wall, and return them."""
    for line in table(
        "layer", "over the cavity", "rule", "strokes", "off the rule", "within the layer", "starts", THICKNESS.column,
        COVERED_ONCE.column,
    ):  # fmt: skip
        print(line, flush=True)
    own = solved(one.labels, wall=list(one.wall), cavity=[one.cavity], base=list(one.base))
    layers: list[Strokes] = []
    for each in layers_through(one, own, folder, height=height, spacing=spacing):
        layers.append(each)
        print(_layer_row(each), flush=True)
    lengths = np.concatenate([each.lengths for each in layers])
    means = [
        float(np.average(np.concatenate(values), weights=lengths))
        for values in ([each.off for each in layers], [each.within for each in layers])
    ]
    starts = sum(each.paths.toolpath.curves.count for each in layers)
    print(row("all", "", "", "", *(f"{mean:.2f} deg" for mean in means), str(starts), "", ""), flush=True)
    return layers


def _layer_row(layer: Strokes) -> str:
    place, found = layer.paths.workpiece.place, layer.paths.uniformity
    assert place is not None
    assert found is not None
    return row(
        f"{place.number} of {place.count}",
        f"{place.middle:.2f} mm",
        f"{layer.mean(layer.wanted):.1f} deg",
        f"{layer.mean(layer.found):.1f} deg",
        f"{layer.mean(layer.off):.2f} deg",
        f"{layer.mean(layer.within):.2f} deg",
        str(layer.paths.toolpath.curves.count),
        f"{found.thickness.cv:.1%}",
        f"{found.covered_once:.1%}",
    )


def _carried(heights: Sequence[float]) -> Iterator[str]:
    """Yield the table of carried fields."""
    yield from table("field", "height", "mean off", "99 of 100", "singularities", "were to be")
    tube = cylinder_patch(divisions=(72, 24), jitter_seed=1)
    rule = HelixRule(np.radians(30.0), np.radians(30.0))
    helix = rule.field(tube, heights=tube.vertices[:, 1], depths=np.zeros(len(tube.vertices)))
    cap, flat = spherical_cap(rings=24, jitter_seed=1), disc(rings=16, jitter_seed=1)
    circles = _prescribed(cap, [(0.0, 0.0, 30.0)], [1.0])
    several = _prescribed(flat, [(8.0, 0.0, 0.0), (-8.0, 0.0, 0.0), (0.0, 8.0, 0.0)], [1.0, 0.5, -0.5])
    for height in heights:
        for name, field in (("helix on a tube", helix), ("circles on a cap", circles), ("three on a disc", several)):
            yield _carried_row(name, field, height)


def _prescribed(surface: Surface, places: list[tuple[float, float, float]], indices: list[float]) -> DirectionField:
    found = singularities_near(surface, np.array(places), indices=np.array(indices))
    return prescribed_field(surface, symmetry=2, singularities=found, preferences=[AlongRim()])


def _carried_row(name: str, field: DirectionField, height: float) -> str:
    level = level_surface(field.surface, height=height, edge_length=1.0, tolerance=0.01)
    middles = level.vertices[level.faces].mean(axis=1)
    found = carried_field(field, level, feet=closest(field.surface, middles)[0])
    wanted, kept = _formula(name, middles)
    errors = np.degrees(off(found, wanted, kept))
    counted, asked = (each.singularities().indices for each in (found, field))
    shown = ("", "") if not errors.size else (f"{errors.mean():.2f} deg", f"{np.quantile(errors, 0.99):.2f} deg")
    return row(
        name, f"{height:g} mm", *shown,
        *(" ".join(f"{index:g}" for index in sorted(each.tolist())) or "none" for each in (counted, asked)),
    )  # fmt: skip


def _formula(name: str, middles: FloatArray) -> tuple[FloatArray, BoolArray]:
    """Return (m, 3) lines by formula, and (m,) where they are known."""
    if name == "helix on a tube":
        right = np.cross([0.0, 1.0, 0.0], middles)
        right /= np.linalg.norm(right, axis=1)[:, None]
        up = np.array([0.0, 1.0, 0.0])
        return np.cos(np.radians(30.0)) * right + np.sin(np.radians(30.0)) * up, np.ones(len(middles), dtype=np.bool_)
    around: FloatArray = np.cross([0.0, 0.0, 1.0], middles)
    return around, np.asarray((np.linalg.norm(around, axis=1) > NEAR) & (name == "circles on a cap"))


if __name__ == "__main__":
    main()
