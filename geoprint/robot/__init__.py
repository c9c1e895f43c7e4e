"""The arm's motion from poses to a checked trajectory: kinematics, reach, timing, clearance. Metres stay inside."""

from typing import TYPE_CHECKING

from geoprint.lazy import attached

if not TYPE_CHECKING:
    __getattr__, __dir__ = attached(__name__, modules="arm collision controller placing reach timing")
