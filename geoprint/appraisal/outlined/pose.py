"""Where a camera stood, by the outline of the part in its photograph: many poses tried, the best ones fitted.

Where several fit alike, as of a part that looks the same from two sides, the lines that are printed decide, if they do
so clearly. Where they do not, or do not lie where the plan has them, or the outline leaves open what is seen where,
nothing is placed.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from geoprint.appraisal.camera import Camera, Lens, OutlinePlacing
from geoprint.appraisal.outlined.fitting import FittedPose, OutlineFit
from geoprint.appraisal.outlined.lines import PrintedLines
from geoprint.appraisal.outlined.part_outline import OutlinedPart
from geoprint.appraisal.outlined.picture_outline import PictureOutline
from geoprint.appraisal.outlined.search import has_a_side, likely_poses
from geoprint.errors import InputError
from geoprint.model import FloatArray, Surface
from geoprint.surfaces import mean_normal, united
from geoprint.transforms import inverse, rotation_angle

# A camera looks at the print at least this steeply [rad].
FLATTEST = np.radians(10.0)
# So many of the poses that are tried are fitted coarsely, and so many of these finely.
COARSE, FINE = 100, 12
COARSE_PLACES, FINE_PLACES = 200, 900
COARSE_STEPS, FINE_STEPS = 12, 40
# Poses are one that see all places of the part within this share of what counts as another edge.
SAME_COARSELY, SAME_FINELY = 4.0, 0.25
# An outline fits where it is off by no more of what counts as another edge, and tells enough where places of the part
# are seen within so much of that, with 95 % confidence.
WORST_SHARE, MOST_WITHIN = 0.5, 2.0
# Another pose fits as well where residuals of so many stretches that err on their own are no more likely under the best
# one than by this factor of their squares (a factor of 20,000 in likelihood).
STRETCHES, LEAST_WORSE = 40.0, 20.0
# Lines of a print lie within this of the runs, over the spacing, half of what lines elsewhere do; and they tell one
# place of the camera from another where they lie so many times nearer. None is nearer than the last one says.
MOST_LINES_OFF, CLEARLY, NEAREST_LINES = 0.125, 2.0, 0.01


def camera_by_outline(
    seen: PictureOutline, printed: Surface, lens: Lens, *, lines: PrintedLines, beside: Sequence[Surface] = ()
) -> Camera:
    """Return where a camera stood, by the outline of the part in its photograph.

    Args:
        seen: the outline in the picture.
        printed: the surface that is printed on, and that the camera looks at.
        lens: of the camera.
        lines: that the photograph shows, and their plan.
        beside: what stands there besides, as the body that the surface lies on.

    Raises:
        InputError: no pose fits, several do and the lines tell none from another, the lines lie beside the plan, or
            the outline leaves open what is seen where.
    """
    fit = OutlineFit(seen, OutlinedPart(united([printed, *beside])), lens, printed=printed)
    alike = _alike(_fitted(fit, facing=mean_normal(printed)), fit)
    allowed = MOST_WITHIN * fit.most_off
    # What is seen within what is allowed is no other place of the camera: it makes the best one less certain.
    others = [each for each in alike[1:] if fit.apart(alike[0], each) > allowed]
    best, off, clearer = _decided([alike[0], *others], fit, lines)
    if off > MOST_LINES_OFF:
        raise InputError(
            f"seen as the outline of {printed.name} has it, the printed lines lie {off:.0%} of the spacing beside the "
            f"runs in the mean, allowed are {MOST_LINES_OFF:.1%}: it may be another plan or part, lines found with a "
            "wrong `--width`, or a print far off its path; give `--fiducials`, four places of the part or more.",
            lines_off=off,
        )
    spread = max(apart for each in alike if (apart := fit.apart(best, each)) <= allowed)
    within = float(np.hypot(fit.within(best, places=FINE_PLACES), spread))
    if not within <= allowed:
        raise InputError(
            f"the outline of {printed.name} leaves open where the camera stood: places of the part are seen within "
            f"{within:.3g} pixels only (95 %), allowed are {allowed:.3g}; give `--fiducials`, four places of the part "
            "or more.",
            within=within,
        )
    camera = Camera(lens, best.T_camera_work, best.off, 0)
    pixels = fit.outlined.under(camera, places=FINE_PLACES).pixels
    placing = OutlinePlacing(pixels, within, 1 + len(others), clearer)
    return Camera(lens, best.T_camera_work, best.off, 0, placing)


def _fitted(fit: OutlineFit, *, facing: FloatArray) -> list[FittedPose]:
    """Return the poses that the outline may have been seen from, the best first."""
    tried = likely_poses(fit.seen, fit.outlined, fit.lens, facing=facing)[:COARSE]
    coarse = [fit.fitted(pose, steps=COARSE_STEPS, places=COARSE_PLACES) for pose in tried]
    likely = _distinct(coarse, fit, share=SAME_COARSELY)[:FINE]
    fine = [fit.fitted(each.T_camera_work, steps=FINE_STEPS, places=FINE_PLACES) for each in likely]
    return [each for each in _distinct(fine, fit, share=SAME_FINELY) if _looks_at(each, fit, facing)]


def _distinct(poses: Sequence[FittedPose | None], fit: OutlineFit, *, share: float) -> list[FittedPose]:
    """Return poses that see a place of the part farther apart than a share of `most_off`, the best first."""
    found: list[FittedPose] = []
    for each in sorted((pose for pose in poses if pose is not None), key=lambda pose: pose.off):
        if all(fit.apart(each, other) > share * fit.most_off for other in found):
            found.append(each)
    return found


def _looks_at(each: FittedPose, fit: OutlineFit, facing: FloatArray) -> bool:
    """Return whether a camera looks at what is printed."""
    away = inverse(each.T_camera_work)[:3, 3] - fit.places.mean(axis=0)
    steep = float(away @ facing) / float(np.linalg.norm(away) * max(float(np.linalg.norm(facing)), 1e-12))
    return steep > np.sin(FLATTEST) or not has_a_side(facing)


def _alike(found: Sequence[FittedPose], fit: OutlineFit) -> list[FittedPose]:
    """Return the best pose, if it fits, and those that fit as well."""
    allowed = WORST_SHARE * fit.most_off
    if not found or found[0].off > allowed:
        off = f"; the nearest is {found[0].off:.2g} pixels off, allowed are {allowed:.2g}" if found else ""
        raise InputError(
            f"no place of the camera shows the outline of {fit.outlined.surface.name} as the photograph does{off}; "
            "check the lens, and that the part, with the body of the plan, and nothing else stands out in it, or give "
            "`--fiducials`, four places of the part or more.",
        )
    squares = [STRETCHES * (each.off / found[0].off) ** 2 for each in found]
    return [each for each, square in zip(found, squares, strict=True) if square - STRETCHES < LEAST_WORSE]


def _decided(
    alike: Sequence[FittedPose], fit: OutlineFit, lines: PrintedLines
) -> tuple[FittedPose, float, float | None]:
    """Return of poses that fit alike the one by the lines, how far off these are, and how much clearer it is."""
    tried = sorted(
        ((lines.off(Camera(fit.lens, each.T_camera_work, each.off, 0)), each) for each in alike),
        key=lambda pair: pair[0],
    )
    (off, best), *rest = tried
    if not rest:
        return best, off, None
    clearer = max(rest[0][0], NEAREST_LINES) / max(off, NEAREST_LINES)
    if clearer < CLEARLY:
        turn = np.degrees(rotation_angle(best.T_camera_work[:3, :3] @ rest[0][1].T_camera_work[:3, :3].T))
        raise InputError(
            f"the outline of {fit.outlined.surface.name} looks alike from {len(alike)} places of the camera, two of "
            f"them {float(turn):.0f} degrees apart, and the printed lines do not tell which: they lie {clearer:.2g} "
            f"times nearer to the plan from one than from the other, needed are {CLEARLY:g} times; give "
            "`--fiducials`, four places of the part or more.",
            alike=len(alike),
            clearer=clearer,
        )
    return best, off, clearer
