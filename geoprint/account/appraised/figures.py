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
from geoprint.appraisal import (
    Appraisal,
    AppraisedPhotograph,
    BeadLine,
    Camera,
    Directed,
    Held,
    OnPlan,
    PhotographedParts,
    SetDistances,
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
        plan=found.plan,
        part=found.part,
        printed=None if found.printed is None else record_printed(found.printed),
        shade=found.shade,
        width_chosen=found.width_chosen,
        threshold_chosen=found.threshold_chosen,
        photographs=tuple(_photograph(each, height=found.height) for each in found.photographs),
        pairs=tuple(
            PairRecord(first=names[one], second=names[other], apart_px=_apart(distances))
            for one, other, distances in found.pairs
        ),
    )
    return sealed(told)


def _photograph(each: AppraisedPhotograph, *, height: float | None) -> PhotographRecord:
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
        on_plan=None if each.on_plan is None or height is None else _on_plan(each.on_plan, height=height),
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


def _on_plan(found: OnPlan, *, height: float) -> OnPlanRecord:
    held, camera = found.held, found.camera
    plan = held.plan
    widths, offsets = held.widths[held.seen], held.offsets[held.seen]
    judged = float(plan.lengths[held.judged].sum())
    strays = len(held.strays)
    return OnPlanRecord(
        camera=CameraRecord(
            place_mm=place_of(camera.place),
            fiducials=camera.fiducials,
            outline=_outline(camera, scale=found.placed.scale),
            residual_px=camera.residual,
            lens_residual_px=camera.lens.residual,
            mm_per_px=found.placed.scale,
        ),
        reach_mm=held.reach,
        judged=judged / float(plan.lengths.sum()),
        missing=float(plan.lengths[held.judged & ~held.seen].sum()) / judged,
        width_mean_mm=float(widths.mean()),
        width_cv=_cv(held.even[held.seen]),
        offset_mean_mm=float(offsets.mean()),
        offset_rms_mm=_rms(offsets),
        strays=strays / len(found.placed.middles),
        apart_mm=_apart(held.apart),
        runs=tuple(_run(held, number) for number in np.unique(plan.runs).tolist()),
        parts=_parts(photographed_parts(held), height=height),
    )


def _parts(parts: PhotographedParts, *, height: float) -> tuple[PhotographedPartRecord, ...]:
    def measured(values: FloatArray, k: int) -> float | None:
        return float(values[k]) if parts.seen[k] else None

    return tuple(
        PhotographedPartRecord(
            run=int(parts.runs[k]),
            start_mm=float(parts.starts[k]),
            end_mm=float(parts.ends[k]),
            width_mm=measured(parts.widths, k),
            width_deviation_mm=measured(parts.width_deviations, k),
            width_planned_mm=float(parts.flows[k]) / height,
            offset_mm=measured(parts.offsets, k),
            offset_deviation_mm=measured(parts.offset_deviations, k),
        )
        for k in range(parts.runs.size)
    )


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
    there = own & held.seen
    widths, offsets = held.widths[there], held.offsets[there]
    some = bool(there.any())
    return RunRecord(
        run=number,
        length_mm=float(plan.lengths[own].sum()),
        judged_mm=float(plan.lengths[own & held.judged].sum()),
        missing_mm=float(plan.lengths[own & held.judged & ~held.seen].sum()),
        width_mean_mm=float(widths.mean()) if some else None,
        width_cv=_cv(held.even[there]) if some else None,
        offset_mean_mm=float(offsets.mean()) if some else None,
        offset_rms_mm=_rms(offsets) if some else None,
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
