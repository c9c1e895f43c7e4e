"""What a path orders of the arm and the dispenser, target by target."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.postprocessor.export_cases import orders, stream

RADIUS = 20.0


@pytest.mark.parametrize("bulging", [True, False])
def test_a_flow_is_by_the_length_that_the_tip_moves_and_lays_what_is_planned_by_that_of_the_surface(
    *, bulging: bool
) -> None:
    poses = stream(points=40)
    angles = np.linspace(0.0, 1.5, poses.count)
    normals = np.column_stack([np.sin(angles), np.zeros_like(angles), np.cos(angles)])
    away = RADIUS + poses.standoff if bulging else RADIUS - poses.standoff
    outward = normals if bulging else -normals
    round_a_cylinder = replace(poses, tips=away * normals, normals=outward)
    found = orders(round_a_cylinder)
    assert found.deposited.any()
    np.testing.assert_allclose(found.flow[found.deposited], 0.5 * RADIUS / away, rtol=1e-9)
    assert not found.flow[~found.deposited].any()
