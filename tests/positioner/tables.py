"""Tables that the tests of machines share, and random poses of their plates."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from geoprint import transforms
from geoprint.config import cell_of, packaged_cell_text
from geoprint.model import FloatArray, Hexapod, TiltTurn
from geoprint.positioner import HexapodMachine, TiltTurnMachine


def hexapod_noun(**keys: object) -> Hexapod:
    """Return the default hexapod of a cell, beside the arm and turned about its axis, with some keys changed."""
    table = cell_of(cell_text("hexapod", keys), name="cell.toml").table
    assert isinstance(table, Hexapod)
    return table


def tilt_turn_noun(**keys: object) -> TiltTurn:
    """Return the default tilt-turn table of a cell, where the hexapod stands, with some keys changed."""
    table = cell_of(cell_text("tilt-turn", keys), name="cell.toml").table
    assert isinstance(table, TiltTurn)
    return table


def hexapod(**keys: object) -> HexapodMachine:
    """Return `hexapod_noun` in motion."""
    return HexapodMachine(hexapod_noun(**keys))


def tilt_turn(**keys: object) -> TiltTurnMachine:
    """Return `tilt_turn_noun` in motion."""
    return TiltTurnMachine(tilt_turn_noun(**keys))


def cell_text(kind: str, keys: dict[str, object]) -> str:
    """Return the packaged cell with a table."""
    given = {"position_mm": [350.0, -20.0, 5.0], "rpy_deg": [0.0, 0.0, 40.0], **keys}
    lines = [f"{key} = {value}" for key, value in given.items()]
    return packaged_cell_text("irb120-bent45") + "\n".join(["", "[table]", f'kind = "{kind}"', *lines, ""])


def random_poses(count: int, *, shift: float, turn: float, seed: int = 0) -> FloatArray:
    """Return (count, 4, 4) poses shifted by up to so much along each axis [mm] and turned by up to so much [rad]."""
    random = np.random.default_rng(seed)
    rotations = Rotation.from_rotvec(random.uniform(-turn, turn, (count, 3))).as_matrix()
    return transforms.rigid(rotations, random.uniform(-shift, shift, (count, 3)))


def random_directions(count: int, *, seed: int = 0) -> FloatArray:
    """Return (count, 3) unit vectors all around."""
    vectors = np.random.default_rng(seed).normal(size=(count, 3))
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
