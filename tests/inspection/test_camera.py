"""A lens is found from checkerboards and a camera from fiducials, both as an independent simulated camera has them."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from geoprint.errors import InputError, UsageError
from geoprint.inspection import Fiducials, Lens, Photograph, camera_by, lens_of
from geoprint.model import FloatArray
from geoprint.simulation import Viewpoint, looking_at

pytestmark = pytest.mark.needs("cv2")

SIZE, FOCAL, RADIAL = (480, 360), 620.0, (-0.12, 0.03)
CORNERS, SQUARE = (7, 5), 10.0


def view(place: tuple[float, float, float], *, turn: float = 0.0) -> Viewpoint:
    return looking_at(
        np.array([40.0, 30.0, 0.0]), place=np.array(place), focal=FOCAL, size=SIZE, turn=turn, radial=RADIAL
    )


def lens(seen: Viewpoint) -> Lens:
    return Lens(seen.size, np.full(2, seen.focal), seen.middle, np.array(seen.radial))


@cache
def board(number: int) -> Photograph:
    """A checkerboard of 8 x 6 squares in the plane z = 0 with a white rim, held in one of five ways."""
    seen = view(STANDS[number], turn=0.2 * number)
    # So many rays along either side of a pixel.
    rays, fine = seen.rays(), 3
    shades = np.zeros(len(rays))
    steps = (np.arange(fine) + 0.5) / fine - 0.5
    for du in steps:
        for dv in steps:
            moved = rays + (du * seen.axes[0] + dv * seen.axes[1]) / seen.focal
            at = seen.place - moved * (seen.place[2] / moved[:, 2])[:, None]
            column, row = np.floor(at[:, 0] / SQUARE), np.floor(at[:, 1] / SQUARE)
            inside = (column >= 0) & (column <= CORNERS[0]) & (row >= 0) & (row <= CORNERS[1])
            shades += np.where(inside & ((column + row) % 2 == 0), 0.1, 0.9) / fine**2
    return Photograph("board", shades.reshape(seen.size[1], seen.size[0]))


def fiducials(seen: Viewpoint, places: FloatArray, *, noise: float = 0.0) -> Fiducials:
    pixels = seen.pixels(places) + noise * np.random.default_rng(2).standard_normal((len(places), 2))
    return Fiducials(tuple(f"f{k}" for k in range(len(places))), pixels, places)


PLACES = np.array([[0.0, 0.0, 0.0], [80.0, 0.0, 4.0], [80.0, 60.0, 0.0], [0.0, 60.0, 9.0], [40.0, 30.0, 12.0]])
STANDS = [(40.0, 30.0, 130.0), (-20.0, -10.0, 110.0), (110.0, 10.0, 115.0), (30.0, 95.0, 105.0), (75.0, 80.0, 120.0)]


def test_a_lens_is_found_from_boards_held_in_five_ways() -> None:
    found = lens_of([board(number) for number in range(len(STANDS))], corners=CORNERS)
    assert found.residual < 0.2
    assert found.focal == pytest.approx([FOCAL, FOCAL], rel=0.01)
    assert found.centre == pytest.approx(view(STANDS[0]).middle, abs=3.0)
    # What matters: where the corners of the picture look.
    edge = np.array([[0.0, 0.0], [479.0, 0.0], [479.0, 359.0]])
    true = lens(view(STANDS[0])).directions(edge)
    assert np.abs(found.directions(edge) - true).max() * FOCAL < 2.0


@pytest.mark.parametrize("place", STANDS)
def test_a_camera_stands_where_its_fiducials_say(place: tuple[float, float, float]) -> None:
    seen = view(place, turn=0.4)
    found = camera_by(fiducials(seen, PLACES), lens(seen))
    assert np.abs(found.place - seen.place).max() < 1e-4
    assert found.residual < 1e-6
    pixels = np.array([[3.0, 4.0], [470.0, 20.0], [240.0, 180.0]])
    rays = seen.rays().reshape(360, 480, 3)
    expected = rays[pixels[:, 1].astype(int), pixels[:, 0].astype(int)]
    assert np.abs(found.directions(pixels) - expected).max() < 1e-7
    assert np.abs(found.seen(PLACES) - seen.pixels(PLACES)).max() < 1e-5


def test_four_fiducials_in_a_plane_with_noise_still_place_it() -> None:
    seen = view(STANDS[1])
    flat = PLACES[:4] * [1.0, 1.0, 0.0]
    found = camera_by(fiducials(seen, flat, noise=0.5), lens(seen))
    assert np.abs(found.place - seen.place).max() < 2.0
    assert 0.0 < found.residual < 1.0


def test_what_places_no_camera_is_refused() -> None:
    seen = view(STANDS[0])
    with pytest.raises(InputError, match="at least 4 fiducials, found 3"):
        camera_by(fiducials(seen, PLACES[:3]), lens(seen))
    line = np.linspace([0.0, 0.0, 0.0], [80.0, 60.0, 0.0], 6)
    with pytest.raises(InputError, match="lie on a line"):
        camera_by(fiducials(seen, line), lens(seen))
    right = fiducials(seen, PLACES)
    swapped = Fiducials(right.names, right.pixels[[1, 0, 2, 3, 4]], right.places)
    with pytest.raises(InputError, match="no camera position fits the 5 fiducials"):
        camera_by(swapped, lens(seen))


def test_what_makes_no_lens_is_refused() -> None:
    boards = [board(number) for number in range(2)]
    with pytest.raises(UsageError, match="needs 3 photographs"):
        lens_of(boards, corners=CORNERS)
    with pytest.raises(InputError, match="no checkerboard with 6 x 4 inner corners"):
        lens_of([*boards, Photograph("x", np.full((360, 480), 0.5))], corners=(6, 4))
    with pytest.raises(InputError, match="differ in size"):
        lens_of([*boards, Photograph("x", np.full((60, 80), 0.5))], corners=CORNERS)
    with pytest.raises(InputError, match="positive focal length"):
        Lens(SIZE, np.array([600.0, -1.0]), np.zeros(2), np.zeros(2))
    with pytest.raises(InputError, match="bends the corner"):
        Lens(SIZE, np.array([100.0, 100.0]), np.zeros(2), np.array([0.4, 0.0]))
