"""What is laid along the paths: constant flow, or flow that follows the local width, and how even each makes the layer.

The cell's signals decide which one a plan carries: 'io' can only open and shut a valve, so the flow is constant;
'analog' sets it along the way, so it follows.
"""

from __future__ import annotations

from dataclasses import asdict, replace

from geoprint.account.rounding import rounded
from geoprint.deposition import exposure, following_flow
from geoprint.export import Json
from geoprint.model import FloatArray, PoseStream
from geoprint.quality import LevelledLayer, Thickness
from geoprint.results import Laid, Workpiece


def lay(poses: PoseStream, widths: FloatArray, workpiece: Workpiece, *, spacing: float) -> tuple[PoseStream, Laid]:
    """Give a stream the flow that the cell's signals allow, and simulate the layer with either flow.

    Args:
        poses: the stream with constant flow.
        widths: (p,) of the strip of surface at each pose, over the spacing.
        workpiece: what it is laid on.
        spacing: distance between neighbouring paths [mm].

    Returns:
        The stream with the flow to print, and both layers.
    """
    cell = workpiece.cell
    followed = following_flow(widths, deposit=poses.deposit, spacing=spacing, layer_height=cell.process.layer_height)
    layer = LevelledLayer(poses, workpiece.part, spacing=spacing)
    light = exposure(cell.material, speed=cell.process.speed, spacing=spacing, flood=cell.flood)
    laid = Laid(
        cell.signals.mode, light, constant=layer(poses.flow), following=layer(followed), following_flow=followed
    )
    return (replace(poses, flow=followed) if laid.mode == "analog" else poses), laid


def laid_summary(laid: Laid) -> dict[str, Json]:
    """Return what plan.json and compare.json say of the layer: thickness mm, its variation (CV) as shares of 1."""
    flow = laid.following_flow[laid.following_flow > 0.0]
    return {
        "flow": "follows the width" if laid.mode == "analog" else "constant",
        "share_away_from_medial_axis": rounded(laid.constant.away_share),
        "constant_flow": _thickness(laid.constant),
        "following_flow": _thickness(laid.following)
        | {"least_mm3_per_mm": rounded(flow.min()), "most_mm3_per_mm": rounded(flow.max())},
        "light": None if laid.light is None else asdict(laid.light),
    }


def laid_text(laid: Laid) -> str:
    """Return the line that a person reads."""
    away = laid.constant.cv is not None
    constant, following = (
        f"{(found.cv if away else found.near_cv) or 0.0:.2%}" for found in (laid.constant, laid.following)
    )
    which = "follows" if laid.mode == "analog" else "is constant"
    where = "" if away else "; fronts meet all over this part"
    return (
        f"layer: thickness varies by {constant} with constant flow, {following} with flow that follows the width; here "
        f"it {which}{where}"
    )


def _thickness(found: Thickness) -> dict[str, Json]:
    return {
        "mean_mm": rounded(found.mean),
        "cv": None if found.cv is None else rounded(found.cv),
        "cv_near_medial_axis": None if found.near_cv is None else rounded(found.near_cv),
    }
