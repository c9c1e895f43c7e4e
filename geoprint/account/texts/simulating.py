"""What a person reads of a print in silico: what lies along each run, beside what its path asks for."""

from __future__ import annotations

from geoprint.account.records.simulated import SimulatedRecord
from geoprint.account.texts.appraising import grid

COLUMNS = ("run", "wanted mm3", "laid mm3", "laid / wanted", "beside mm3", "longest bare mm")


def simulated_text(told: SimulatedRecord) -> str:
    """Return a table of the runs, and how the print was laid."""
    rows = [
        [
            str(each.run + 1), f"{each.wanted_mm3:.2f}", f"{each.laid_mm3:.2f}",
            f"{each.laid_mm3 / each.wanted_mm3:.3f}",
            f"{each.beside_mm3:.2f}", f"{each.longest_bare_mm:.2f}",
        ]
        for each in told.runs
    ]  # fmt: skip
    share = told.laid_mm3 / told.wanted_mm3
    by = (
        "by its program, executed as it stands in the folder, with the lags of its cell"
        if told.laid_by == "program"
        else "by its paths, because it has no program"
    )
    put_in = (
        f"put in: flow x {told.flow:g}, width of beads x {told.spread:g} +/- "
        f"{told.width_noise:.1%}, {told.offset_mm:+g} mm to the left; seed {told.seed}"
    )
    return "\n".join(
        [
            *grid(COLUMNS, rows),
            "",
            f"{told.plan}: {told.laid_mm3:.1f} mm3 laid in silico, {share:.3f} of what its paths ask for, {by}",
            put_in,
        ]
    )
