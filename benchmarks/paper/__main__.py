"""Does the paper's experiment come out again? Its three simulated prints, analysed as it does, beside its Table II.

    python -m benchmarks.paper [--samples 100] [--repeats 20] [--seed 1] [--parts FILE ...] [--smoke]

Cases A, B and C of Table I (`data/paper_case_*.toml`) are planned on both heart patches of data/, and on any patches
[mm] besides; simulated with all that the paper does not say fixed beforehand (`benchmarks.paper.prints`);
photographed by a camera that stands still; and their edge images compared by eq. 3. The first table prints what is
fixed, the second our distances beside the paper's 62.2254, 72.8354 and 47.3814 pixels. Nobody knows the paper's
camera, so sizes count only beside each other. The third tells what each print truly is: best is the case whose layer is
nearest to the wanted one, 0.5 mm everywhere. The last ones print the fixed printing `--repeats` times with other noise,
and draw `--samples` printings from all that is plausible, on the heart patches in turn, and tell in which share of them
the paper's order comes out and C is best, with an exact interval. Other parts are photographed with no body below, and
no printings are drawn on them. `python -m benchmarks.guide --draw paper.png` draws the figure.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from benchmarks.paper.comparing import PAPER, Compared, Draw, compared, draws, order_text, orders, repeats, shares
from benchmarks.paper.prints import BODY, DATA, PLAUSIBLE, fixed_printing, studio_of
from benchmarks.parts.tables import row, script_parser, table
from geoprint.errors import percent
from geoprint.model import PASCAL_PER_KPA

PARTS = ("heart_flat_patch.ply", "heart_apex_patch.ply")
SEED = 1
# Pixels for each mm in the smoke run: a third as many.
SMOKE_SCALE = 2.0


def main() -> None:
    """Print the tables."""
    parser = script_parser(__doc__, smoke="the smallest case only, to see that the script runs")
    parser.add_argument("--samples", type=int, default=100, metavar="N", help="printings drawn")
    parser.add_argument("--repeats", type=int, default=20, metavar="N", help="prints of the fixed printing")
    parser.add_argument("--seed", type=int, default=SEED, help="of the noise, and of what is drawn")
    parser.add_argument("--parts", nargs="+", type=Path, default=[], metavar="FILE", help="patches [mm] besides")
    arguments = parser.parse_args()
    if min(arguments.samples, arguments.repeats) < 1:
        parser.error(f"--samples {arguments.samples} --repeats {arguments.repeats}: a share needs one print at least")
    names = PARTS[:1] if arguments.smoke else PARTS
    own = [studio_of(DATA / name, body=BODY) for name in names]
    studios = [*own, *(studio_of(part, body=part) for part in arguments.parts)]
    fixed = replace(fixed_printing(), scale=SMOKE_SCALE) if arguments.smoke else fixed_printing()
    found = {studio.name: compared(studio, fixed, seed=arguments.seed) for studio in studios}
    for lines in (assumptions(), distances(found, scale=fixed.scale), layers(found)):
        for line in lines:
            print(line, flush=True)
    counts, scale = ((1, 1), SMOKE_SCALE) if arguments.smoke else ((arguments.repeats, arguments.samples), None)
    for what, drawn, count in zip(
        ("fixed, other noise", "all that is plausible"), (repeats, draws), counts, strict=True
    ):
        for line in counted(what, list(drawn(own, count=count, seed=arguments.seed, scale=scale))):
            print(line, flush=True)


def assumptions() -> Iterator[str]:
    """Yield a Markdown table: what the paper does not say, as it is fixed, and how far it may lie from that."""
    yield from table("not in the paper", "fixed at", "from", "to", "why")
    for name, each in PLAUSIBLE.items():
        yield row(name, f"{each.fixed:g}", f"{each.low:g}", f"{each.high:g}", f"{each.why}; drawn {each.drawn}")


def distances(found: Mapping[str, Compared], *, scale: float) -> Iterator[str]:
    """Yield a Markdown table: our Table II beside the paper's, and what the single number hides.

    Args:
        found: by the name of the part.
        scale: pixels for each mm.
    """
    yield from table(
        "part", "cases", "paper [px]", "over its largest", "ours [px]", "over our largest", "ours [mm]",
        "95 % [px]", "mean [px]",
    )  # fmt: skip
    for name, each in found.items():
        several = each.distances
        largest = max(apart.hausdorff for apart in several.values())
        for pair, apart in several.items():
            yield row(
                name, "-".join(pair), f"{PAPER[pair]:.4f}", f"{PAPER[pair] / max(PAPER.values()):.3f}",
                f"{apart.hausdorff:.4f}", f"{apart.hausdorff / largest:.3f}", f"{apart.hausdorff / scale:.2f}",
                f"{apart.p95:.1f}", f"{apart.mean:.2f}",
            )  # fmt: skip
    yield ""
    yield from (f"{name}: {order_text(each)}, best is {each.best}." for name, each in found.items())


def layers(found: Mapping[str, Compared]) -> Iterator[str]:
    """Yield a Markdown table: what was laid, of which the photographs show the outside."""
    yield from table(
        "part", "case", "air [kPa]", "rounds", "final exposure [s]", "spacing [mm]", "bead [mm2]", "thickness, of 1",
        "bare", "off the layer by",
    )  # fmt: skip
    for name, each in found.items():
        figures = zip(each.prints, each.thickness, each.bare, each.unevenness, strict=True)
        for printed, thick, bare, uneven in figures:
            case = printed.case
            flood = case.cell.flood
            yield row(
                name, case.name, f"{case.pressure / PASCAL_PER_KPA:g}", f"{case.rounds}",
                "none" if flood is None else f"{flood.duration:g}", f"{case.spacing:.2f}", f"{printed.area:.2f}",
                f"{thick:.2f}", percent(bare, 1), percent(uneven, 1),
            )  # fmt: skip


def counted(what: str, several: Sequence[Draw]) -> Iterator[str]:
    """Yield Markdown tables: in which share of the draws the paper is confirmed, and which orders came out.

    Args:
        what: was drawn.
        several: one or more.
    """
    parts = sorted({each.part for each in several})
    yield from table(what, *parts, *(["all"] if len(parts) > 1 else []))
    groups = [[each for each in several if each.part == part] for part in parts]
    columns = [shares(group) for group in (*groups, *([several] if len(parts) > 1 else []))]
    for asked in columns[0]:
        yield row(asked, *(each[asked].text for each in columns))
    yield from table("order", "share")
    yield from (row(order, percent(count / len(several))) for order, count in orders(several))


if __name__ == "__main__":
    main()
