"""The page of a stack as HTML: verdict, the finished thickness in 3D with the layers that make it, and every layer."""

from __future__ import annotations

from geoprint.report.blocks import choice, fact_table, figure, row_table, said, scene_block, view
from geoprint.report.histogram import histograms
from geoprint.report.markup import Markup, element, joined
from geoprint.report.stacked.values import StackReport


def stack_section(stack: StackReport, *, key: str) -> Markup:
    """Return the section of a stack.

    Args:
        stack: what to show.
        key: makes the ids in the page unique.
    """
    blocks = [
        element("p", stack.verdict[0], class_="verdict"),
        _scene(stack, key),
        said(stack.verdict[1:], stack.cautions),
        element("h2", stack.words.table),
        _layers(stack),
        _pages(stack),
        element("h2", "How the finished thickness is distributed"),
        element(
            "p", "Share of the area by its finished thickness; shaded: within 5% of the wanted one. Each row has its "
            "own height.", class_="note",
        ),
        histograms(
            [(flow.name, flow.ratios) for flow in stack.flows], of="area",
            axis="finished thickness / wanted thickness [1]",
        ),
        *(element("section", element("h2", head), *map(figure, some)) for head, some in stack.pictures if some),
        element("h2", "How it was made"),
        fact_table("Settings", stack.settings),
        fact_table("Input, SHA-256", stack.inputs),
        fact_table("Versions", stack.versions),
    ]  # fmt: skip
    return element("section", *blocks, id=key, class_="part", aria_label=stack.name)


def _scene(stack: StackReport, key: str) -> Markup:
    """Return the views of the flows side by side, and how many layers of paths are shown on them."""
    names = [(str(place), flow.name) for place, flow in enumerate(stack.flows)]
    count = max(paths.layers.size for paths in stack.paths)
    shown = element(
        "label", "Paths of layers up to ",
        element("input", type="range", name=f"{key}-layers", min=0, max=count, value=0, step=1),
        element("output", "none", class_="layers"),
    )  # fmt: skip
    controls = [
        choice(key, "backend", stack.words.view, [("all", "Side by side"), *names] if len(names) > 1 else names),
        choice(key, "colour", "Colour", [("thickness", "Finished thickness")]),
        element(
            "fieldset", element("legend", "Show"), shown, element("button", "Reset view", type="button", class_="reset")
        ),
    ]
    views = [
        view(
            flow.still, key=key, place=place, name=flow.name, title=flow.title, figures=flow.figures,
            label=f"3D view of {stack.name}, {flow.name}",
            mark=(stack.words.mark, stack.words.marked) if place == 0 and len(names) > 1 else None,
        )
        for place, flow in enumerate(stack.flows)
    ]  # fmt: skip
    return scene_block(key, views, controls)


def _layers(stack: StackReport) -> Markup:
    return row_table(stack.columns, stack.rows, label=f"{stack.words.rows} over {stack.name}")


def _pages(stack: StackReport) -> Markup:
    if not stack.pages:
        return Markup("")
    links = joined(*(element("li", element("a", name, href=address)) for name, address in stack.pages))
    return element("p", "Each of them, layer by layer:", element("ul", links), class_="note")
