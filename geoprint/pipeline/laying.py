"""What is laid along the paths: constant flow, or flow that follows the local width, and how even each makes the layer.

The cell's signals decide which one a plan carries: 'io' can only open and shut a valve, so the flow is constant;
'analog' sets it along the way, so it follows.
"""

from __future__ import annotations

from dataclasses import replace

from geoprint.deposition import exposure, following_flow
from geoprint.model import FloatArray, PoseStream
from geoprint.quality import LevelledLayer
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
