"""The page of a stack as HTML: verdict, the finished thickness in 3D with the layers that make it, and every layer."""

from __future__ import annotations

from geoprint.report.blocks import choice, fact_table, figure, row_table, said, scene_block, view
from geoprint.report.histogram import histograms
from geoprint.report.markup import Markup, element
from geoprint.report.stacked.values import StackReport

PRINTED = "what is printed; it is shown where there is room for one"


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
        element("h2", "Layer by layer"),
        _layers(stack),
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
    count = int(stack.layers.size)
    shown = element(
        "label", "Paths of layers up to ",
        element("input", type="range", name=f"{key}-layers", min=0, max=count, value=0, step=1),
        element("output", "none", class_="layers"),
    )  # fmt: skip
    controls = [
        choice(key, "backend", "Flow", [("all", "Side by side"), *names] if len(names) > 1 else names),
        choice(key, "colour", "Colour", [("thickness", "Finished thickness")]),
        element(
            "fieldset", element("legend", "Show"), shown, element("button", "Reset view", type="button", class_="reset")
        ),
    ]
    views = [
        view(
            flow.still, key=key, place=place, name=flow.name, title=flow.title, figures=flow.figures,
            label=f"3D view of {stack.name}, {flow.name}",
            mark=("printed", PRINTED) if place == 0 and len(names) > 1 else None,
        )
        for place, flow in enumerate(stack.flows)
    ]  # fmt: skip
    return scene_block(key, views, controls)


def _layers(stack: StackReport) -> Markup:
    return row_table(stack.columns, stack.rows, label=f"Layers of the stack on {stack.name}")
