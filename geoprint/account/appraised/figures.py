"""From appraised photographs to what appraisal.json says of them."""

from __future__ import annotations

from importlib.metadata import version

import numpy as np

from geoprint.account.prints.feedback import record_printed
from geoprint.account.records.appraisal import (
    ApartRecord,
    AppraisalRecord,
    CameraRecord,
    DirectedRecord,
    LineRecord,
    OnPlanRecord,
    OutlineRecord,
    PairRecord,
    PhotographedPartRecord,
    PhotographRecord,
    RunRecord,
)
from geoprint.account.records.feedback import sealed
from geoprint.account.records.rounding import place_of
from geoprint.account.records.scan import EstimateRecord, ShiftRecord
from geoprint.appraisal import (
    Appraisal,
    AppraisedPhotograph,
    BeadLine,
    Camera,
    Directed,
    Held,
    OnPlan,
    PhotographedParts,
    PrintShift,
    RunEstimate,
    SetDistances,
    doubts,
    photographed_parts,
)
from geoprint.model import FloatArray

# Version of the layout of appraisal.json; a change that breaks a reader raises it.
APPRAISAL_SCHEMA = 2


def record_appraisal(found: Appraisal) -> AppraisalRecord:
    """Return what appraisal.json says: the source of text and tables."""
    names = [each.photograph.name for each in found.photographs]
    told = AppraisalRecord(
        schema=APPRAISAL_SCHEMA,
        version=version("geoprint"),
        kind="photographs",
        plan=found.plan,
        part=found.part,
        printed=None if found.printed is None else record_printed(found.printed),
        shade=found.shade,
        width_chosen=found.width_chosen,
        threshold_chosen=found.threshold_chosen,
        photographs=tuple(_photograph(each) for each in found.photographs),
        pairs=tuple(
            PairRecord(first=names[one], second=names[other], apart_px=_apart(distances))
            for one, other, distances in found.pairs
        ),
    )
    return sealed(told)


def _photograph(each: AppraisedPhotograph) -> PhotographRecord:
    photograph = each.photograph
    widths = np.concatenate([bead.widths[bead.seen] for bead in each.beads])
    return PhotographRecord(
        file=photograph.name,
        sha256=photograph.digest,
        size_px=photograph.size,
        turned=photograph.turned,
        bead_width_px=each.width,
        threshold=each.threshold,
        length_px=sum(bead.length for bead in each.beads),
        width_mean_px=float(widths.mean()),
        width_cv=_cv(widths),
        lines=tuple(_line(bead) for bead in each.beads),
        on_plan=None if each.on_plan is None else _on_plan(each.on_plan),
    )


def _line(bead: BeadLine) -> LineRecord:
    widths = bead.widths[bead.seen]
    arcs = np.concatenate([[0.0], np.cumsum(bead.steps)])
    return LineRecord(
        length_px=bead.length,
        width_mean_px=float(widths.mean()),
        width_cv=_cv(widths),
        closed=bead.closed,
        breaks_px=tuple((float(arcs[first]), float(arcs[last])) for first, last in bead.breaks),
    )


def _on_plan(found: OnPlan) -> OnPlanRecord:
    held, camera = found.held, found.camera
    plan, measured = held.plan, held.measured
    widths, offsets = held.widths[held.sized], held.offsets[held.sized]
    judged, known = float(plan.lengths[held.judged].sum()), bool(held.sized.any())
    return OnPlanRecord(
        camera=CameraRecord(
            place_mm=place_of(camera.place),
            fiducials=camera.fiducials,
            outline=_outline(camera, scale=measured.scale),
            residual_px=camera.residual,
            lens_residual_px=camera.lens.residual,
            mm_per_px=measured.scale,
        ),
        reach_mm=held.reach,
        judged=judged / float(plan.lengths.sum()),
        missing=float(plan.lengths[held.judged & ~held.seen].sum()) / judged,
        usual=held.usual if known else None,
        width_mean_mm=float(widths.mean()) if known else None,
        width_planned_mm=float(np.average(held.planned, weights=plan.lengths)),
        width_cv=_cv(held.even[held.sized]) if known else None,
        offset_mean_mm=float(offsets.mean()) if known else None,
        offset_rms_mm=_rms(offsets) if known else None,
        shift=record_shift(held.shift),
        offset_deviation_common_mm=held.pose_deviation,
        blur_px=measured.optics.blur,
        gamma=measured.optics.gamma,
        white=measured.white,
        darker=measured.darker,
        doubts=tuple(doubts(held)),
        strays=held.strays,
        apart_mm=_apart(held.apart),
        runs=tuple(_run(held, number) for number in np.unique(plan.runs).tolist()),
        parts=_parts(photographed_parts(held)),
    )


def record_shift(found: PrintShift | None) -> ShiftRecord | None:
    """Return what appraisal.json says of a shift of a whole print."""
    return None if found is None else ShiftRecord(by_mm=place_of(found.by), deviation_mm=found.deviation)


def _parts(parts: PhotographedParts) -> tuple[PhotographedPartRecord, ...]:
    return tuple(
        PhotographedPartRecord(
            run=int(parts.runs[k]),
            start_mm=float(parts.starts[k]),
            end_mm=float(parts.ends[k]),
            width_mm=None if width is None else width.value,
            width_deviation_mm=None if width is None else width.deviation,
            width_planned_mm=float(parts.planned[k]),
            offset_mm=None if offset is None else offset.value,
            offset_deviation_mm=None if offset is None else offset.deviation,
        )
        for k, (width, offset) in enumerate(zip(parts.widths, parts.offsets, strict=True))
    )


def _estimate(found: RunEstimate | None) -> EstimateRecord | None:
    return None if found is None else EstimateRecord(value=found.value, deviation=found.deviation)


def _outline(camera: Camera, *, scale: float) -> OutlineRecord | None:
    placing = camera.outline
    if placing is None:
        return None
    return OutlineRecord(
        within_px=placing.within,
        within_mm=placing.within * scale,
        alike=placing.alike,
        clearer=placing.clearer,
    )


def _run(held: Held, number: int) -> RunRecord:
    plan = held.plan
    own = plan.runs == number
    there = own & held.sized
    width = held.width(number)
    return RunRecord(
        run=number,
        length_mm=float(plan.lengths[own].sum()),
        judged_mm=float(plan.lengths[own & held.judged].sum()),
        seen_mm=float(plan.lengths[there].sum()),
        missing_mm=float(plan.lengths[own & held.judged & ~held.seen].sum()),
        width_mm=_estimate(width),
        width_planned_mm=float(np.average(held.planned[own], weights=plan.lengths[own])),
        of_usual=_estimate(held.share(number)),
        whole=held.whole(number),
        width_cv=None if width is None else _cv(held.even[there]),
        offset_mm=_estimate(held.offset(number)),
        offset_rms_mm=None if width is None else _rms(held.offsets[there]),
        gaps_mm=tuple(held.gaps(number)),
        blobs_mm=tuple(held.blobs(number)),
        thin_mm=tuple(held.thin(number)),
    )


def _apart(distances: SetDistances) -> ApartRecord:
    return ApartRecord(
        hausdorff=distances.hausdorff,
        p95=distances.p95,
        mean=distances.mean,
        there=_directed(distances.there),
        back=_directed(distances.back),
    )


def _directed(distances: Directed) -> DirectedRecord:
    return DirectedRecord(largest=distances.largest, p95=distances.p95, mean=distances.mean)


def _cv(values: FloatArray) -> float:
    return float(values.std() / values.mean())


def _rms(values: FloatArray) -> float:
    return float(np.sqrt((values**2).mean()))
