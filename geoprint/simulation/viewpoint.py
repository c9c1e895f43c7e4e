"""A simulated photograph: where the camera stands and how it sees and develops beads in known light."""

from __future__ import annotations

import io
from typing import final

import numpy as np
from scipy import ndimage
from scipy.spatial import KDTree
from scipy.spatial.transform import Rotation

from geoprint.errors import InputError
from geoprint.geometry import normals
from geoprint.geometry.rays import first_hits
from geoprint.model import BoolArray, FloatArray, Surface, comparable, freeze_arrays, frozen
from geoprint.simulation.deposited import DepositedBeads

# Where a simulated camera stands, and how it sees: a pinhole with a lens that bends.


# Newton steps that undo the bending; each doubles the figures that are right.
STEPS = 12


@final
@frozen
class Viewpoint:
    """A camera.

    Attributes:
        place: (3,) of the pinhole, in the part's coordinates [mm].
        axes: (3, 3) rows: right and down in the picture, and ahead, in the part's coordinates.
        focal: focal length [pixels].
        size: width and height of the picture [pixels]; the axis meets its middle.
        radial: k1 and k2: what lies r off the axis, at distance 1, is seen at r (1 + k1 r^2 + k2 r^4).
    """

    place: FloatArray
    axes: FloatArray
    focal: float
    size: tuple[int, int]
    radial: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        freeze_arrays(self, place="float: 3", axes="float: 3 3")

    @property
    def middle(self) -> FloatArray:
        """(2,) the pixel in which the axis meets the picture."""
        return 0.5 * (np.array(self.size, dtype=np.float64) - 1.0)

    def pixels(self, places: FloatArray) -> FloatArray:
        """Return the (k, 2) pixels (u, v) of (k, 3) places in front of the camera [mm]."""
        seen = (places - self.place) @ self.axes.T
        flat = seen[:, :2] / seen[:, 2:]
        r2 = (flat * flat).sum(axis=1)[:, None]
        return self.middle + self.focal * flat * (1.0 + r2 * (self.radial[0] + r2 * self.radial[1]))

    def rays(self) -> FloatArray:
        """Return the (h * w, 3) unit directions of all pixels, row after row."""
        columns, rows = np.meshgrid(np.arange(self.size[0]), np.arange(self.size[1]))
        bent = (np.column_stack([columns.ravel(), rows.ravel()]) - self.middle) / self.focal
        far = np.hypot(bent[:, 0], bent[:, 1])
        k1, k2 = self.radial
        near = far.copy()
        for _ in range(STEPS):
            near -= (near * (1.0 + k1 * near**2 + k2 * near**4) - far) / (1.0 + 3.0 * k1 * near**2 + 5.0 * k2 * near**4)
        flat = bent * np.divide(near, far, out=np.ones_like(far), where=far > 0.0)[:, None]
        ahead = np.column_stack([flat, np.ones(len(flat))]) @ self.axes
        return ahead / np.linalg.norm(ahead, axis=1, keepdims=True)


def looking_at(
    target: FloatArray,
    *,
    place: FloatArray,
    focal: float,
    size: tuple[int, int],
    turn: float = 0.0,
    radial: tuple[float, float] = (0.0, 0.0),
) -> Viewpoint:
    """Return a camera that looks at a place of the part.

    Args:
        target: (3,) that it looks at [mm].
        place: (3,) where it stands [mm].
        focal: focal length [pixels].
        size: width and height of the picture [pixels].
        turn: about its axis, clockwise as it sees it [rad].
        radial: k1 and k2 of its lens.

    Raises:
        InputError: it stands where it looks at.
    """
    ahead = np.asarray(target, dtype=np.float64) - place
    length = float(np.linalg.norm(ahead))
    if length == 0.0:
        raise InputError("a camera stands somewhere else than where it looks at.")
    ahead = ahead / length
    # Of the part's axes the one that is farthest from the line of sight shows what is down.
    guide = -np.eye(3)[1] if abs(ahead[1]) < 0.9 else np.eye(3)[2]
    right = np.cross(guide, ahead)
    right /= np.linalg.norm(right)
    axes = np.array([right, np.cross(ahead, right), ahead])
    spun = Rotation.from_rotvec(turn * ahead).apply(axes)
    return Viewpoint(np.asarray(place, dtype=np.float64), spun, focal, size, radial)


# A photograph of beads on a part, as a known camera sees and develops them in known light.
#
# Every pixel sends a ray to the surface. Where it lands within half a width of the middle of a bead, it goes on to
# the bead's skin: a parabola, highest in the middle. Light falls on that skin as Lambert says, on part and bead
# alike, which differ in how much of it they give back.


# Times that a ray is led on to the skin of a bead: heights change little over what is left.
SKIN_STEPS = 3
# A pixel is so many places a side where a circle covers a part of it; odd.
FINER = 9


@final
@frozen
class Lighting:
    """Light, and what it falls on.

    Attributes:
        direction: (3,) towards the lamp, in the part's coordinates; of any length.
        ambient: share of the light that comes from everywhere.
        part: share of light that the part gives back.
        bead: share of light that a bead gives back.
        behind: share of light that comes from where there is no part.
    """

    direction: FloatArray
    ambient: float = 0.4
    part: float = 0.35
    bead: float = 0.9
    behind: float = 0.05

    def __post_init__(self) -> None:
        freeze_arrays(self, direction="float: 3")
        if not np.linalg.norm(self.direction) > 0.0:
            raise InputError("light comes from somewhere: its direction is zero.")


@final
@comparable
class Development:
    """What a camera makes of the light that reaches it.

    Attributes:
        exposure: by which light is multiplied; what comes to more than 1 is white.
        tone: gamma of the tone curve, grey = light^(1 / gamma); 0 for that of sRGB.
        blur: standard deviation of the unsharpness [pixels].
        defocus: diameter of the circle that a point is seen as [pixels].
        grain: standard deviation of the noise of each pixel, in shares of white light.
    """

    exposure: float = 1.0
    tone: float = 1.0
    blur: float = 0.7
    defocus: float = 0.0
    grain: float = 0.01

    def __post_init__(self) -> None:
        values = (self.exposure, self.tone, self.blur, self.defocus, self.grain)
        if not (np.isfinite(values).all() and self.exposure > 0.0 and min(values) >= 0.0):
            raise InputError(
                f"a photograph has a positive exposure and no negative tone, blur, defocus and grain, found "
                f"{', '.join(f'{value:g}' for value in values)}."
            )


def pictured(
    surface: Surface,
    beads: DepositedBeads,
    view: Viewpoint,
    lighting: Lighting,
    development: Development | None = None,
    *,
    random: np.random.Generator,
) -> FloatArray:
    """Return the (h, w) grey values, 0 to 1, of a photograph of beads on a part.

    Args:
        surface: the part.
        beads: on it.
        view: where the camera stands.
        lighting: the light.
        development: what the camera makes of it; as by default if None.
        random: of the noise.

    Raises:
        InputError: the camera does not see the part.
    """
    rays = view.rays()
    hits = first_hits(surface, np.broadcast_to(view.place, rays.shape).copy(), rays)
    if not hits.met.any():
        raise InputError(f"the camera does not see {surface.name}: no ray meets it; place it elsewhere.")
    up = normals(surface, hits.points)
    toward = rays[hits.met]
    # The side that is looked at, where the part is seen from behind.
    up = up * -np.sign((up * toward).sum(axis=1))[:, None]
    skin, on_bead = _skin(beads, hits.points.xyz(surface), up, toward)
    lamp = lighting.direction / np.linalg.norm(lighting.direction)
    lit = lighting.ambient + (1.0 - lighting.ambient) * np.clip(skin @ lamp, 0.0, None)
    shown = np.full(len(rays), lighting.behind)
    shown[hits.met] = lit * np.where(on_bead, lighting.bead, lighting.part)
    return developed(shown.reshape(view.size[1], view.size[0]), development or Development(), random=random)


def developed(light: FloatArray, development: Development, *, random: np.random.Generator) -> FloatArray:
    """Return the (h, w) grey values, 0 to 1, that a camera makes of the light in each pixel: blurred, exposed, toned.

    Args:
        light: (h, w) in shares of white.
        development: what the camera does.
        random: of the noise.
    """
    seen = ndimage.gaussian_filter(light, development.blur)
    if development.defocus > 0.0:
        seen = ndimage.convolve(seen, _disc(development.defocus), mode="nearest")
    noise = development.grain * random.standard_normal(light.shape)
    exposed: FloatArray = np.clip(development.exposure * seen + noise, 0.0, 1.0)
    if development.tone == 0.0:
        return np.where(exposed <= 0.0031308, 12.92 * exposed, 1.055 * exposed ** (1.0 / 2.4) - 0.055)
    return exposed ** (1.0 / development.tone)


def _disc(diameter: float) -> FloatArray:
    """Return the (j, j) shares of a point that each pixel gets of a circle of some diameter [pixels]."""
    reach = int(np.ceil(0.5 * diameter))
    fine = (np.arange(-FINER * reach - FINER // 2, FINER * reach + FINER // 2 + 1)) / FINER
    inside = np.hypot(fine[:, None], fine) <= 0.5 * diameter
    shares = inside.reshape(2 * reach + 1, FINER, 2 * reach + 1, FINER).sum(axis=(1, 3)).astype(np.float64)
    return shares / shares.sum()


def png(grey: FloatArray) -> bytes:
    """Return (h, w) grey values from 0 to 1 as a PNG of 8 bits."""
    from PIL import Image

    written = io.BytesIO()
    Image.fromarray(np.rint(255.0 * grey).astype(np.uint8)).save(written, format="PNG")
    return written.getvalue()


def _skin(
    beads: DepositedBeads, landed: FloatArray, up: FloatArray, toward: FloatArray
) -> tuple[FloatArray, BoolArray]:
    """Return the (k, 3) normals of what rays meet that land on the part, and whether that is a bead."""
    tree = KDTree(beads.places)
    steep = np.maximum(-(up * toward).sum(axis=1), 0.1)
    foot, skin, on_bead = landed, up, np.zeros(len(landed), dtype=np.bool_)
    for _ in range(SKIN_STEPS):
        _, nearest = tree.query(foot)
        off = foot - beads.places[nearest]
        half = 0.5 * beads.widths[nearest]
        share = np.divide(np.linalg.norm(off, axis=1), half, out=np.full(len(foot), np.inf), where=half > 0.0)
        height = np.where(share < 1.0, beads.height * (1.0 - np.minimum(share, 1.0) ** 2), 0.0)
        on_bead = share < 1.0
        slope = np.divide(2.0 * beads.height, half**2, out=np.zeros_like(half), where=on_bead)
        skin = up + slope[:, None] * (off - (off * up).sum(axis=1)[:, None] * up)
        # Back along the ray to where it is so high, and straight down from there.
        foot = landed - (height / steep)[:, None] * toward - height[:, None] * up
    return skin / np.linalg.norm(skin, axis=1, keepdims=True), on_bead
