"""The hexapod: where its six legs bring the plate, and how far each of its limits is.

The lengths of the legs follow from the plate's pose in closed form. The pose follows from the lengths by Newton's
method from rest; of the up to 40 poses with the same lengths [Merlet2006] it is the one that the plate reaches
from rest, as long as the legs hold it all along: `margins` is negative long before they do not.
"""

from __future__ import annotations

from itertools import combinations
from typing import NamedTuple, final

import numpy as np
from scipy.spatial.transform import Rotation

from geoprint import transforms
from geoprint.errors import InputError, ReachError
from geoprint.model import Cylinder, FloatArray, Hexapod

# Six legs between a base and a plate: lengths, directions, distances and the Jacobian, for many poses at once.


LEGS = 6
# Every leg with every other.
PAIRS = np.array(list(combinations(range(LEGS), 2)))
# Two legs are parallel where the squared sine of their angle is below this: then any point of one serves as well.
PARALLEL = 1e-12


class Legs(NamedTuple):
    """The legs at n poses of the plate.

    Attributes:
        feet: (6, 3) lower joints in the table's frame [mm].
        heads: (n, 6, 3) upper joints in the table's frame [mm].
        arms: (n, 6, 3) from the plate's origin to the upper joints, in the table's frame [mm].
        lengths: (n, 6) from joint to joint [mm].
        directions: (n, 6, 3) unit vectors up the legs, in the table's frame.
        from_plate: (n, 6, 3) the same in the plate's frame.
    """

    feet: FloatArray
    heads: FloatArray
    arms: FloatArray
    lengths: FloatArray
    directions: FloatArray
    from_plate: FloatArray


def legs_at(hexapod: Hexapod, Ts_table_plate: FloatArray) -> Legs:
    """Return the legs at (n, 4, 4) poses of the plate: l_i = |t + R q_i - b_i|, the closed form [Merlet2006]."""
    rotations = Ts_table_plate[:, :3, :3]
    arms = hexapod.plate_joints @ np.swapaxes(rotations, 1, 2)
    heads = arms + Ts_table_plate[:, None, :3, 3]
    spans = heads - hexapod.base_joints
    lengths = np.sqrt(np.einsum("nij,nij->ni", spans, spans))
    directions = spans / lengths[..., None]
    return Legs(hexapod.base_joints, heads, arms, lengths, directions, directions @ rotations)


def jacobians(legs: Legs, *, scale: float) -> FloatArray:
    """Return how the legs' lengths follow the plate: (n, 6, 6), a leg a row.

    Args:
        legs: at n poses.
        scale: length by which a turn counts [mm], so that all six columns have one unit.

    Returns:
        Derivatives by a shift of the plate's origin [mm] and by a turn about it [rad times the scale], both in the
        table's frame [Merlet2006].
    """
    return np.concatenate([legs.directions, np.cross(legs.arms, legs.directions) / scale], axis=2)


def distances(legs: Legs) -> FloatArray:
    """Return the (n, 15) distances between the axes of any two legs, from joint to joint [mm] [Ericson2005]."""
    one, other = PAIRS.T
    along = legs.heads - legs.feet
    first, second = along[:, one], along[:, other]
    apart = (legs.feet[one] - legs.feet[other])[None]
    lengths = legs.lengths**2
    a, e = lengths[:, one], lengths[:, other]
    b = _dot(first, second)
    c, f = _dot(first, apart), _dot(second, apart)
    sine = a * e - b * b
    s = np.where(sine > PARALLEL * a * e, (b * f - c * e) / np.maximum(sine, PARALLEL * a * e), 0.0)
    s = np.clip(s, 0.0, 1.0)
    t = np.clip((b * s + f) / e, 0.0, 1.0)
    # The nearest point of the first leg to where the second was cut off; the same where it was not.
    s = np.clip((b * t - c) / a, 0.0, 1.0)
    between = apart + s[..., None] * first - t[..., None] * second
    return np.sqrt(_dot(between, between))


def _dot(one: FloatArray, other: FloatArray) -> FloatArray:
    return np.asarray(np.einsum("...i,...i->...", one, other))


# What is left of the smallest singular value of the legs' Jacobian at rest, where the plate counts as singular: forces
# in the legs, and errors of the pose, are ten times those at rest.
SINGULAR_SHARE = 0.1
# Newton's method ends where no leg misses its length by more than this share of the longest: a few hundred roundings.
CONVERGED = 1e-13
MOST_ITERATIONS = 60
# A direction in which the legs hold the plate with less than this share of the firmest is left alone in an iteration.
SLACK = 1e-9
# Largest turn in one iteration [rad], beyond which the linear model says nothing.
LARGEST_TURN = 0.3
# So many poses at a time stay in the processor's cache.
BLOCK = 2048


@final
class HexapodMachine:
    """A hexapod in motion; a `TiltingTable` whose axes are the lengths of its legs [mm].

    Args:
        hexapod: as the cell describes it.

    Raises:
        InputError: the plate at rest is beyond one of its limits, or singular.
    """

    __slots__ = ("_at_rest", "_hexapod", "_room", "_scale", "_stiffness")

    def __init__(self, hexapod: Hexapod) -> None:
        self._hexapod = hexapod
        self._scale = float(np.linalg.norm(hexapod.plate_joints[:, :2], axis=1).mean())
        self._at_rest = legs_at(hexapod, np.eye(4)[None])
        self._stiffness = float(self._smallest(self._at_rest)[0])
        self._room = distances(self._at_rest)[0] - hexapod.leg_diameter
        lengths = self._at_rest.lengths[0]
        if lengths.min() <= hexapod.lengths[0] or lengths.max() >= hexapod.lengths[1]:
            raise InputError(
                f"{self.name}: at rest its legs are {lengths.min():.1f} to {lengths.max():.1f} mm long, but may be "
                f"{hexapod.lengths[0]:g} to {hexapod.lengths[1]:g}; correct joints or lengths."
            )
        if self._room.min() <= 0.0:
            raise InputError(
                f"{self.name}: at rest two legs are {self._room.min() + hexapod.leg_diameter:.1f} mm apart from axis "
                f"to axis, but {hexapod.leg_diameter:g} mm thick; correct the joints or the diameter."
            )
        if self._stiffness < SINGULAR_SHARE**2:
            raise InputError(f"{self.name}: its legs do not hold the plate at rest; move the joints of a pair apart.")

    @property
    def name(self) -> str:
        """What messages call it."""
        return self._hexapod.name

    @property
    def T_base_table(self) -> FloatArray:
        """(4, 4) the table's frame in the robot's base."""
        return self._hexapod.T_base_table

    @property
    def rotary(self) -> bool:
        """No: its legs change their lengths."""
        return False

    @property
    def speeds(self) -> FloatArray:
        """(6,) largest speeds of its legs [mm/s]."""
        return np.full(LEGS, self._hexapod.leg_speed)

    def plates(self, ups: FloatArray) -> FloatArray:
        """Return the poses of the plate that turn directions of it up.

        The plate turns about its pivot by the smallest angle, so that it never twists about its own axis. Straight
        down is an exception: there the axis of the half turn is free, and always the same one is taken.

        Args:
            ups: (n, 3) unit directions in the plate's frame.

        Returns:
            (n, 4, 4) T_table_plate; limits are not applied.
        """
        pivot = np.array([0.0, 0.0, self._hexapod.pivot])
        rotations = np.swapaxes(transforms.smallest_rotation(np.array([0.0, 0.0, 1.0]), ups), 1, 2)
        return transforms.rigid(rotations, pivot - rotations @ pivot)

    def axes(self, Ts_table_plate: FloatArray) -> FloatArray:
        """Return the (n, 6) lengths of the legs at (n, 4, 4) poses of the plate [mm]; limits are not applied."""
        return legs_at(self._hexapod, Ts_table_plate).lengths

    def plate(self, axes: FloatArray) -> FloatArray:
        """Return the pose of the plate at given lengths of the legs, by Newton's method from rest.

        Args:
            axes: (6,) lengths [mm].

        Returns:
            (4, 4) T_table_plate; limits are not applied.

        Raises:
            ReachError: no pose was found, or the legs do not hold the plate at the one that was.
        """
        T_table_plate, longest = np.eye(4), float(np.abs(axes).max())
        for _ in range(MOST_ITERATIONS):
            legs = legs_at(self._hexapod, T_table_plate[None])
            missing: FloatArray = axes - legs.lengths[0]
            jacobian: FloatArray = jacobians(legs, scale=self._scale)[0]
            if np.abs(missing).max() <= CONVERGED * longest:
                self._check_held(legs, axes)
                return T_table_plate
            step: FloatArray = np.linalg.pinv(jacobian, rcond=SLACK) @ missing
            turn = step[3:] / self._scale
            share = LARGEST_TURN / max(float(np.linalg.norm(turn)), LARGEST_TURN)
            T_table_plate[:3, 3] += share * step[:3]
            T_table_plate[:3, :3] = Rotation.from_rotvec(share * turn).as_matrix() @ T_table_plate[:3, :3]
        raise ReachError(
            f"{self.name}: no pose of the plate has legs of {axes.round(2).tolist()} mm; at rest they are "
            f"{self._at_rest.lengths[0].round(2).tolist()} mm.",
            lengths=tuple(map(float, axes)),
        )

    def margins(self, Ts_table_plate: FloatArray) -> FloatArray:
        """Return the smallest share left of any limit.

        Limits are the lengths of the legs, the cones of their joints, their distances from each other, and the smallest
        singular value of their Jacobian (turns scaled by the radius of the upper joints), which may fall to
        `SINGULAR_SHARE` of what it is at rest.

        Args:
            Ts_table_plate: (n, 4, 4) poses of the plate.

        Returns:
            (n,) of each limit 1 is left at rest, 0 at the limit, and less beyond.
        """
        result = np.empty(len(Ts_table_plate))
        for start in range(0, len(result), BLOCK):
            legs = legs_at(self._hexapod, Ts_table_plate[start : start + BLOCK])
            left = [
                self._strokes_left(legs).min(axis=1),
                _cones_left(legs.directions, self._at_rest.directions, cone=self._hexapod.base_cone),
                _cones_left(legs.from_plate, self._at_rest.from_plate, cone=self._hexapod.plate_cone),
                ((distances(legs) - self._hexapod.leg_diameter) / self._room).min(axis=1),
                (self._smallest(legs) / self._stiffness - SINGULAR_SHARE) / (1.0 - SINGULAR_SHARE),
            ]
            result[start : start + BLOCK] = np.minimum.reduce(left)
        # Legs may stand farther apart than at rest, and the plate more firmly: no share is above what is left there.
        return np.minimum(result, 1.0)

    def solids(self, T_table_plate: FloatArray) -> tuple[Cylinder, ...]:
        """Return plate, six legs and base at a (4, 4) pose of the plate, in the robot's base."""
        hexapod = self._hexapod
        legs = legs_at(hexapod, T_table_plate[None])
        low = float(hexapod.base_joints[:, 2].min())
        plate = transforms.apply(T_table_plate, np.array([[0.0, 0.0, 0.0], [0.0, 0.0, -hexapod.plate_thickness]]))
        base = np.array([[0.0, 0.0, low], [0.0, 0.0, low - hexapod.base_height]])
        ends = [
            ("table's plate", *plate, hexapod.plate_diameter),
            *(
                (f"table's leg {number}", foot, head, hexapod.leg_diameter)
                for number, (foot, head) in enumerate(zip(legs.feet, legs.heads[0], strict=True), start=1)
            ),
            ("table's base", *base, hexapod.base_diameter),
        ]
        return tuple(
            Cylinder(
                name, transforms.apply(self.T_base_table, start), transforms.apply(self.T_base_table, end), diameter / 2
            )
            for name, start, end, diameter in ends
        )

    def _smallest(self, legs: Legs) -> FloatArray:
        """Return the (n,) smallest singular values of the scaled Jacobian."""
        matrices = jacobians(legs, scale=self._scale)
        squares = np.linalg.eigvalsh(matrices @ np.swapaxes(matrices, 1, 2))[:, 0]
        return np.sqrt(np.maximum(squares, 0.0))

    def _strokes_left(self, legs: Legs) -> FloatArray:
        shortest, longest = self._hexapod.lengths
        rest = self._at_rest.lengths[0]
        return np.minimum((legs.lengths - shortest) / (rest - shortest), (longest - legs.lengths) / (longest - rest))

    def _check_held(self, legs: Legs, axes: FloatArray) -> None:
        share = float(self._smallest(legs)[0]) / self._stiffness
        if share < SINGULAR_SHARE:
            raise ReachError(
                f"{self.name}: with legs of {axes.round(2).tolist()} mm the plate is nearly singular: stiffness is "
                f"{share:.2g} of that at rest, at least {SINGULAR_SHARE:g} is needed. Keep to poses with a margin.",
                share=share,
            )


def _cones_left(directions: FloatArray, rest: FloatArray, *, cone: float) -> FloatArray:
    """Return the (n,) shares left of a cone about the directions at rest."""
    # By the chord: an arc cosine loses half of all figures of small angles.
    chords = np.linalg.norm(directions - rest, axis=2).max(axis=1)
    return 1.0 - 2.0 * np.arcsin(np.minimum(chords / 2.0, 1.0)) / cone
