"""What is said of feedback: what the last print taught, what is changed, and what is expected of it."""

from __future__ import annotations

from collections.abc import Iterator

from geoprint.account.records.feedback import ChangeRecord, FeedbackRecord
from geoprint.deposition.feedback import VALVE_CAUSES
from geoprint.results import Fed, Plan


def record_feedback(plan: Plan) -> FeedbackRecord | None:
    """Return what plan.json says of feedback, or None where the job names none."""
    fed = plan.fed
    if fed is None:
        return None
    flow = plan.poses.flow[plan.poses.deposit]
    there = fed.wanted > 0.0
    factors, found = flow[there] / fed.wanted[there], fed.correction
    return FeedbackRecord(
        sha256=fed.digest,
        plan=fed.plan,
        scan=fed.scan,
        changes=_changes(fed),
        least_factor=float(factors.min()),
        most_factor=float(factors.max()),
        valve_opens_earlier_mm=found.opening,
        valve_shuts_earlier_mm=found.shutting,
        gaps=found.gaps,
        held=fed.held,
        error_found=found.found,
        error_expected=found.expected,
    )


def feedback_notes(told: FeedbackRecord | None) -> Iterator[str]:
    """Say what feedback changed and expects, or that nothing was significant."""
    if told is None:
        return
    found = f"feedback: volume was {told.error_found:.1%} off (RMS) by {told.scan}"
    if not told.changes:
        yield f"{found}, of which nothing is significant: flow and valve stay as they were."
    else:
        causes = ", ".join(_in_words(each) for each in told.changes)
        valve = ", ".join(
            f"{'opens' if earlier else 'shuts'} {abs(by):.2f} mm {'earlier' if by > 0.0 else 'later'}"
            for earlier, by in ((True, told.valve_opens_earlier_mm), (False, told.valve_shuts_earlier_mm))
            if by != 0.0
        )
        yield (
            f"{found}: {causes}; the flow is commanded at {told.least_factor:.2f} to {told.most_factor:.2f} of the "
            f"wanted one{f', the valve {valve}' if valve else ''}; {told.error_expected:.1%} are expected to "
            "be left by these causes (feedback.csv lists the flow)."
        )
    if told.held > 0.0:
        yield f"feedback: the cell's bounds hold the flow at {told.held:.1%} of the poses: more was needed there."
    if told.gaps:
        yield (
            f"feedback: {told.gaps} parts of runs had hardly any material, which no flow mends: look for what stopped "
            "it."
        )


def _changes(fed: Fed) -> tuple[ChangeRecord, ...]:
    return tuple(
        ChangeRecord.model_validate({"cause": each.name, "least": each.least, "most": each.most, "gain": each.gain})
        for each in fed.correction.changes
    )


def _in_words(told: ChangeRecord) -> str:
    if told.cause in VALVE_CAUSES:
        return f"{told.cause} {abs(told.most):.2f} mm too {'late' if told.most > 0.0 else 'early'}"
    if told.least == told.most:
        return f"{told.least:.2f} of it everywhere"
    return f"{'' if told.cause == 'along runs' else 'a '}{told.cause} of {told.least:.2f} to {told.most:.2f}".strip()
