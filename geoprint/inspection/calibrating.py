"""A lens from photographs of a checkerboard, and where a camera stood from fiducials: OpenCV's work, checked."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, final

import numpy as np

from geoprint.errors import InputError, UsageError, how_many
from geoprint.geometry.native import missing
from geoprint.inspection.camera import Camera, Lens
from geoprint.inspection.photograph import Photograph
from geoprint.model import FloatArray, freeze_arrays, frozen

if TYPE_CHECKING:
    from types import ModuleType

    from numpy.typing import NDArray


# Fewer views of a board leave focal length and bending undetermined [Zhang2000].
FEWEST_BOARDS = 3
# Corners of a board are found to a tenth of a pixel; a fit that is worse than this is of another lens [pixels].
WORST_LENS = 1.0
# Four points have as many coordinates as a pose has unknowns, and two to spare.
FEWEST_FIDUCIALS = 4
# Fiducials that are clicked by hand lie within two pixels; what is worse is a wrong row [pixels].
WORST_POSE = 5.0
# Fiducials nearer to one line than this share of their extent leave a turn about it open.
LEAST_BREADTH = 0.02


@final
@frozen
class Fiducials:
    """Places of a part that are known, and where a photograph shows them.

    Attributes:
        names: of each of k.
        pixels: (k, 2) where they are seen [pixels].
        places: (k, 3) in the part's coordinates [mm].
    """

    names: tuple[str, ...]
    pixels: FloatArray
    places: FloatArray

    def __post_init__(self) -> None:
        freeze_arrays(self, pixels="float: k 2", places="float: k 3")


def lens_of(boards: Sequence[Photograph], *, corners: tuple[int, int]) -> Lens:
    """Return the lens that took photographs of a checkerboard [Zhang2000].

    Args:
        boards: three or more, of one board, each at another slant.
        corners: inner corners of the board along its rows and along its columns.

    Raises:
        UsageError: there are too few, or OpenCV is missing.
        InputError: they differ in size, a board is not found, or no lens fits them all.
    """
    cv2 = _opencv()
    if len(boards) < FEWEST_BOARDS:
        raise UsageError(f"a lens needs {FEWEST_BOARDS} photographs of a checkerboard or more, found {len(boards)}.")
    if len({board.size for board in boards}) > 1:
        raise InputError("photographs of the checkerboard differ in size; take all with the camera of the print.")
    columns, rows = corners
    flat = np.zeros((rows * columns, 3), dtype=np.float32)
    flat[:, :2] = np.indices((columns, rows)).reshape(2, -1, order="F").T
    found: list[NDArray[np.float32]] = []
    for board in boards:
        grey = np.rint(255.0 * board.grey).astype(np.uint8)
        there, seen = cv2.findChessboardCornersSB(grey, corners, flags=cv2.CALIB_CB_ACCURACY)
        if not there:
            raise InputError(
                f"`{board.name}` shows no checkerboard with {columns} x {rows} inner corners; show all of it, with a "
                "white rim, or state its corners with `--corners`."
            )
        found.append(np.asarray(seen, dtype=np.float32).reshape(-1, 1, 2))
    size = boards[0].size
    flags = cv2.CALIB_ZERO_TANGENT_DIST | cv2.CALIB_FIX_K3
    residual, matrix, bending, _, _ = cv2.calibrateCamera([flat] * len(found), found, size, None, None, flags=flags)
    if not np.isfinite(residual) or residual > WORST_LENS:
        raise InputError(
            f"no lens fits the {how_many(len(boards), 'checkerboard')}: corners are {residual:.2g} pixels off, "
            f"allowed are {WORST_LENS:g}. Take sharper photographs of a flat board.",
            residual=float(residual),
        )
    bent = np.asarray(bending, dtype=np.float64).ravel()
    return Lens(
        size, np.array([matrix[0, 0], matrix[1, 1]]), np.array([matrix[0, 2], matrix[1, 2]]), bent[:2], float(residual)
    )


def camera_by(fiducials: Fiducials, lens: Lens) -> Camera:
    """Return where a camera stood, by the places that its photograph shows [Terzakis2020].

    Args:
        fiducials: four or more, not in a line.
        lens: of the camera.

    Raises:
        UsageError: OpenCV is missing.
        InputError: there are too few, they lie in a line, or no pose sees them where they are.
    """
    cv2 = _opencv()
    _check(fiducials)
    matrix = np.array([[lens.focal[0], 0.0, lens.centre[0]], [0.0, lens.focal[1], lens.centre[1]], [0.0, 0.0, 1.0]])
    bending = np.array([*lens.radial, 0.0, 0.0])
    count, turns, shifts, _ = cv2.solvePnPGeneric(
        fiducials.places, fiducials.pixels, matrix, bending, flags=cv2.SOLVEPNP_SQPNP
    )
    tried: list[tuple[float, FloatArray]] = []
    for turn, shift in list(zip(turns, shifts, strict=True))[:count]:
        fine_turn, fine_shift = cv2.solvePnPRefineLM(fiducials.places, fiducials.pixels, matrix, bending, turn, shift)
        T_camera_work = np.eye(4)
        T_camera_work[:3, :3] = cv2.Rodrigues(fine_turn)[0]
        T_camera_work[:3, 3] = np.ravel(fine_shift)
        camera = Camera(lens, T_camera_work, 0.0, len(fiducials.names))
        misses = np.linalg.norm(camera.seen(fiducials.places) - fiducials.pixels, axis=1)
        tried.append((float(np.sqrt((misses**2).mean())), T_camera_work))
    residual, T_camera_work = min(tried, key=lambda each: each[0], default=(np.inf, np.eye(4)))
    camera = Camera(lens, T_camera_work, residual, len(fiducials.names))
    if not residual <= WORST_POSE:
        misses = np.linalg.norm(camera.seen(fiducials.places) - fiducials.pixels, axis=1)
        worst = fiducials.names[int(np.argmax(misses))]
        raise InputError(
            f"no camera position fits the {how_many(len(fiducials.names), 'fiducial')}: they are {residual:.3g} "
            f"pixels off, allowed are {WORST_POSE:g}. The worst is `{worst}`: check its row, and the lens.",
            residual=residual,
        )
    return camera


def _check(fiducials: Fiducials) -> None:
    """Refuse fiducials from which no pose follows."""
    if len(fiducials.names) < FEWEST_FIDUCIALS:
        raise InputError(
            f"a camera needs at least {FEWEST_FIDUCIALS} fiducials, found {len(fiducials.names)}; add points of the "
            "part that the photograph shows."
        )
    extents = np.linalg.svd(fiducials.places - fiducials.places.mean(axis=0), compute_uv=False)
    if extents[1] < LEAST_BREADTH * extents[0]:
        raise InputError("all fiducials lie on a line, so the camera may turn about it; add one off the line.")


def _opencv() -> Any:
    try:
        import cv2
    except ImportError as error:
        raise missing("opencv-python-headless", extra="photo", work="placing a camera") from error
    module: ModuleType = cv2
    return module
