"""From the measured evenness of paths to what files say of it."""

from __future__ import annotations

from dataclasses import asdict

from geoprint.account.records.evenness import (
    DistanceRecord,
    EvennessRecord,
    LevelRecord,
    LevelSpacingsRecord,
    SpacingRecord,
    SpacingSideRecord,
    StraightRecord,
    ThicknessRecord,
    WorstPlaceRecord,
)
from geoprint.account.records.printed import PrintedRecord
from geoprint.quality import DistanceErrors, LevelSpacings, SpacingFigures, Thickness, Uniformity

# Places listed where the spacing is farthest from wanted.
WORST_PLACES = 5


def record_evenness(
    measured: Uniformity, *, distance: DistanceErrors | None = None, printed: PrintedRecord | None = None
) -> EvennessRecord:
    """Return the figures of `uniformity` and `measure_paths` as files carry them.

    Args:
        measured: evenness.
        distance: how far the backend's level curves lie from what they promise.
        printed: what is expected of prints.
    """
    return EvennessRecord(
        thickness=_thickness(measured.thickness),
        following=_thickness(measured.followed),
        covered_once=measured.covered_once,
        gap=measured.gap,
        overlap=measured.overlap,
        largest_hole_mm2=measured.hole,
        area_unknown=measured.unknown,
        fill=measured.fill,
        width_cv=measured.width_cv,
        distance=None if distance is None else _distance(distance),
        printed=printed,
        left=_side(measured.sides.left),
        right=_side(measured.sides.right),
        both=_side(measured.sides.both),
        levels=None if measured.levels is None else _levels(measured.levels),
    )


def _distance(found: DistanceErrors) -> DistanceRecord:
    return DistanceRecord(
        mean=found.mean, deviation=found.deviation, largest=found.largest, samples=found.errors.size,
        unknown=found.unknown,
    )  # fmt: skip


def _thickness(found: Thickness) -> ThicknessRecord:
    return ThicknessRecord(**asdict(found))


def _spacing(found: SpacingFigures) -> SpacingRecord | None:
    if not found.measured:
        return None
    p1, p5, p50, p95, p99, largest = (found.percentile(share) for share in (1, 5, 50, 95, 99, 100))
    return SpacingRecord(
        mean=found.mean, cv=found.cv, p1=p1, p5=p5, p50=p50, p95=p95, p99=p99, max=largest,
        within_5_percent=found.within_5_percent,
    )  # fmt: skip


def _side(found: SpacingFigures) -> SpacingSideRecord:
    return SpacingSideRecord(
        spacing=_spacing(found),
        samples=found.ratios.size,
        none=found.none,
        oblique=found.oblique,
        unknown=found.unknown,
    )


def _levels(found: LevelSpacings) -> LevelSpacingsRecord:
    straight = found.straight
    return LevelSpacingsRecord(
        spacing=_spacing(found.figures),
        straight=(
            StraightRecord(mean=float(straight.mean()), cv=float(straight.std() / straight.mean()))
            if found.ratios.size
            else None
        ),
        samples=len(found.ratios),
        samples_bounded=found.bounded,
        largest_doubt=found.largest_doubt,
        samples_unreached=found.unreached,
        samples_where_fronts_meet=found.meeting,
        each=tuple(
            LevelRecord(level=level, mean=mean, cv=cv, worst=worst) for level, mean, cv, worst in found.by_level()
        ),
        worst_places=tuple(
            WorstPlaceRecord(place_mm=place, level=level, ratio=ratio)
            for place, level, ratio in found.worst(WORST_PLACES)
        ),
    )
