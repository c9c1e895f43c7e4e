from __future__ import annotations

import re

import numpy as np
import pinocchio
import pytest

from geoprint.errors import UsageError
from geoprint.robot.arm import MILLIMETRES_PER_METRE
from geoprint.robot.arm.urdf import read_urdf
from geoprint.robot.collision.tool_solids import link_solids


def test_links_are_the_cylinders_that_pinocchio_reads():
    text = read_urdf("irb120")
    model = pinocchio.buildModelFromXML(text)
    shapes = pinocchio.buildGeomFromUrdfString(model, text, pinocchio.GeometryType.COLLISION).geometryObjects

    found = [(link.joint, solid.centre, solid.axis) for link in link_solids("irb120") for solid in link.solids]

    assert len(found) == len(shapes)
    known = [(shape.parentJoint, shape.placement.homogeneous) for shape in shapes]
    for (joint, centre, axis), (parent, pose) in zip(found, known, strict=True):
        assert joint == parent
        np.testing.assert_allclose(centre, pose[:3, 3] * MILLIMETRES_PER_METRE, atol=1e-9)
        np.testing.assert_allclose(axis, pose[:3, 2], atol=1e-9)


def holds(joint: int, point: tuple[float, float, float]) -> bool:
    solids = link_solids("irb120")[joint].solids
    offsets = [(np.array(point) - solid.start, solid) for solid in solids]
    return any(
        0.0 <= offset @ solid.axis <= solid.length
        and np.linalg.norm(offset - (offset @ solid.axis) * solid.axis) <= solid.start_radius
        for offset, solid in offsets
    )


@pytest.mark.parametrize(
    ("joint", "point"),
    [
        (0, (90.0, 90.0, 1.0)),  # corner of the foot of 180 x 180 mm
        (1, (0.0, 0.0, 290.0)),  # crossing of axes 1 and 2
        (2, (0.0, 0.0, 270.0)),  # axis 3
        (3, (0.0, 0.0, 140.0)),  # the arm's height of 700 mm
        (4, (302.0, 0.0, 0.0)),  # wrist centre
        (4, (250.0, 70.0, 0.0)),  # turning radius of axis 4
        (5, (58.0, 0.0, 0.0)),  # where the flange begins
        (6, (0.0, 20.0, 0.0)),  # rim of the flange
    ],
)
def test_links_hold_what_is_published(joint: int, point: tuple[float, float, float]):
    assert holds(joint, point)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('<cylinder radius="0.025" length="0.016"/>', '<sphere radius="0.025"/>', "link_6 has a collision shape"),
        ('radius="0.025"', 'radius="-0.025"', "link_6 has a cylinder of radius -25.0 mm"),
        ("collision>", "visual>", "base_link has no collision shape"),
    ],
)
def test_shape_that_is_no_cylinder_is_refused(old: str, new: str, message: str):
    with pytest.raises(UsageError, match=message):
        link_solids("irb120", urdf=read_urdf("irb120").replace(old, new))


def test_a_shape_without_an_origin_is_in_the_middle_and_one_without_an_attitude_stands_upright():
    text = read_urdf("irb120")
    place = re.compile(r'(<collision>\s*)<origin [^>]*/>(\s*<geometry>\s*<cylinder radius="0.025" length="0.016"/>)')
    assert len(place.findall(text)) == 1
    (middle,) = link_solids("irb120", urdf=place.sub(r"\1\2", text))[6].solids
    np.testing.assert_allclose([middle.start, middle.end], [[0.0, 0.0, -8.0], [0.0, 0.0, 8.0]])
    with pytest.raises(UsageError, match=r"link link_6 has xyz '1 2', which is not three finite numbers"):
        link_solids("irb120", urdf=place.sub(r'\1<origin xyz="1 2"/>\2', text))
    (upright,) = link_solids("irb120", urdf=place.sub(r'\1<origin xyz="0.001 0.002 0.003"/>\2', text))[6].solids
    np.testing.assert_allclose(upright.start, [1.0, 2.0, -5.0])
    np.testing.assert_allclose(upright.end, [1.0, 2.0, 11.0])
    (turned,) = link_solids("irb120", urdf=place.sub(r'\1<origin rpy="0 1.5707963267948966 0"/>\2', text))[6].solids
    np.testing.assert_allclose(turned.start, [-8.0, 0.0, 0.0], atol=1e-9)
