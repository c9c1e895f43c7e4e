from __future__ import annotations

import numpy as np

from geoprint.model import Surface
from geoprint.robot.collision.surroundings import is_closed, winding_numbers
from tests.meshes import sphere


def test_winding_number_tells_inside_from_outside_of_a_sphere():
    ball = sphere(radius=20.0)
    points = np.array([[0.0, 0.0, 0.0], [19.0, 0.0, 0.0], [0.0, 21.0, 0.0], [500.0, 0.0, 0.0]])

    found = winding_numbers(points, ball.vertices[ball.faces])

    np.testing.assert_allclose(found, [1.0, 1.0, 0.0, 0.0], atol=1e-9)
    assert is_closed(ball)
    assert not is_closed(Surface(vertices=ball.vertices, faces=ball.faces[1:]))


def test_surface_of_loose_triangles_is_closed_where_their_corners_meet():
    ball = sphere(radius=20.0)
    loose = ball.vertices[ball.faces].reshape(-1, 3)

    assert is_closed(Surface(vertices=loose, faces=np.arange(len(loose)).reshape(-1, 3)))
    assert not is_closed(Surface(vertices=loose, faces=np.arange(len(loose)).reshape(-1, 3)[1:]))
