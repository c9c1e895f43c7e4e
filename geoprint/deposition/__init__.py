"""The process: how much material flows, what bead it makes, and how valve, lamp and flow follow the path."""

from geoprint.deposition.following import following_flow

__all__ = ["following_flow"]
