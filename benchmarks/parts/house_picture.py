"""The house as a picture: rooms on their floors, wings inside them, arrows from what the code imports.

An arrow that follows from others is left out: who imports `pipeline` has `surfaces` below him anyway. Arrows that pass
a floor take a gap between its rooms; the order on each floor follows from what its rooms are joined to.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise
from typing import TypeAlias, final

from benchmarks.parts.house_tree import PACKAGE, House

# Where the picture lies in the tree.
PICTURE = ".github/images/house.svg"
# Sizes [pixels].
WING_HEIGHT, WING_GAP, TITLE, MARGIN = 24, 8, 30, 12
LETTER, GAP, BETWEEN_FLOORS, LANE = 8, 26, 44, 16
ROOM_FILL, WING_FILL, INK, ARROW = "#eef3f8", "#ffffff", "#22303c", "#5b7c99"
TEXT = 'font-size="13" font-family="DejaVu Sans, Verdana, sans-serif" text-anchor="middle"'
TIP = 'viewBox="0 0 8 8" refX="7" refY="4" markerWidth="7" markerHeight="7" orient="auto"'
# What a crossing is worth, in pixels that arrows run sideways.
CROSSING = 150.0

# What lies on a floor: a room by its name, or the gap that an arrow from one room to another takes on that floor.
_Place: TypeAlias = str | tuple[str, str, int]


@final
@dataclass(frozen=True, slots=True)
class _Box:
    """Where a room or gap lies, and its floor from top to bottom."""

    left: float
    top: float
    width: float
    height: float
    highest: float
    lowest: float

    @property
    def middle(self) -> float:
        return self.left + self.width / 2.0


def picture(house: House) -> str:
    """Return the house as an SVG file; the same house gives the same bytes."""
    arrows = reduced(_between_rooms(house))
    floors = _ordered(_with_gaps(house, arrows), arrows, house)
    boxes = _boxes(house, floors)
    width = max(box.left + box.width for box in boxes.values()) + MARGIN
    height = max(box.top + box.height for box in boxes.values()) + MARGIN
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:g} {height:g}" {TEXT}>',
        f'<defs><marker id="tip" {TIP}><path d="M0 0 8 4 0 8z" fill="{ARROW}"/></marker></defs>',
        '<rect width="100%" height="100%" fill="#ffffff"/>',
        *(_arrow(_route(one, other, floors, boxes)) for one, others in arrows.items() for other in others),
        *(line for place, box in boxes.items() if isinstance(place, str) for line in _room(house, place, box)),
        "</svg>",
    ]
    return "\n".join(lines) + "\n"


def reduced(arrows: Mapping[str, set[str]]) -> Mapping[str, Sequence[str]]:
    """Return the arrows that do not follow from others."""
    return {
        one: sorted(other for other in others if not any(other in _reached(arrows, each) for each in others - {other}))
        for one, others in arrows.items()
    }


def _reached(arrows: Mapping[str, set[str]], start: str) -> set[str]:
    found: set[str] = set()
    ahead = [start]
    while ahead:
        new = arrows.get(ahead.pop(), set[str]()) - found
        found |= new
        ahead += new
    return found


def _between_rooms(house: House) -> Mapping[str, set[str]]:
    rooms = [name for floor in house.floors[PACKAGE] for name in floor if not name.endswith("__main__")]
    of = {name: next((room for room in rooms if f"{name}.".startswith(f"{room}.")), "") for name in house.rooms}
    found: dict[str, set[str]] = {room: set() for room in rooms}
    for one, others in house.arrows().items():
        if of[one]:
            found[of[one]] |= {of[other] for other in others} - {of[one]}
    return found


def _with_gaps(house: House, arrows: Mapping[str, Sequence[str]]) -> list[list[_Place]]:
    """Return the floors from the top, with a gap for each arrow that passes."""
    rooms = [[name for name in floor if name in arrows] for floor in house.floors[PACKAGE]]
    floors: list[list[_Place]] = [[*names] for names in rooms if names]
    at = {name: number for number, names in enumerate(floors) for name in names}
    for one, others in arrows.items():
        for other in others:
            for number in range(at[one] + 1, at[other]):
                floors[number].append((one, other, number))
    return floors


def _ordered(floors: list[list[_Place]], arrows: Mapping[str, Sequence[str]], house: House) -> list[list[_Place]]:
    """Swap places on the floors as long as that spares crossings or makes arrows shorter."""
    widths = {place: _size(house, place)[0] for floor in floors for place in floor}
    drawn = [_stops(one, other, floors) for one, others in arrows.items() for other in others]
    links = [link for stops in drawn for link in pairwise(stops)]
    ends = [[link for link in links if link[0] in floor] for floor in floors]
    least, better = _cost(floors, ends, widths), True
    while better:
        better = False
        for floor in floors:
            for one, other in combinations(range(len(floor)), 2):
                floor[one], floor[other] = floor[other], floor[one]
                cost = _cost(floors, ends, widths)
                if cost < least:
                    least, better = cost, True
                else:
                    floor[one], floor[other] = floor[other], floor[one]
    return floors


def _cost(
    floors: Sequence[Sequence[_Place]],
    ends: Sequence[Sequence[tuple[_Place, _Place]]],
    widths: Mapping[_Place, float],
) -> float:
    """Return how far arrows run sideways, and how often those between the same floors cross."""
    middles: dict[_Place, float] = {}
    for floor in floors:
        left = -(sum(widths[place] for place in floor) + GAP * (len(floor) - 1)) / 2.0
        for place in floor:
            middles[place] = left + widths[place] / 2.0
            left += widths[place] + GAP
    cost = 0.0
    for links in ends:
        lines = [(middles[one], middles[other]) for one, other in links]
        cost += sum(abs(above - below) for above, below in lines)
        cost += CROSSING * sum((a - c) * (b - d) < 0.0 for (a, b), (c, d) in combinations(lines, 2))
    return cost


def _stops(one: str, other: str, floors: Sequence[Sequence[_Place]]) -> list[_Place]:
    """Return what an arrow passes from its start to its end."""
    passed: list[_Place] = [place for floor in floors for place in floor if place[:2] == (one, other)]
    return [one, *passed, other]


def _boxes(house: House, floors: Sequence[Sequence[_Place]]) -> Mapping[_Place, _Box]:
    sizes = {place: _size(house, place) for floor in floors for place in floor}
    widths = [sum(sizes[place][0] for place in floor) + GAP * (len(floor) - 1) for floor in floors]
    found: dict[_Place, _Box] = {}
    top = float(MARGIN)
    for floor, width in zip(floors, widths, strict=True):
        left, height = MARGIN + (max(widths) - width) / 2.0, max(sizes[place][1] for place in floor)
        for place in floor:
            own = height if isinstance(place, tuple) else sizes[place][1]
            found[place] = _Box(left, top + (height - own) / 2.0, sizes[place][0], own, top, top + height)
            left += sizes[place][0] + GAP
        top += height + BETWEEN_FLOORS
    return found


def _size(house: House, place: _Place) -> tuple[float, float]:
    """Return width and height of a room or gap."""
    if isinstance(place, tuple):
        return LANE, 0.0
    wings = _wings(house, place)
    widest = max((sum(map(_text_width, names)) + WING_GAP * (len(names) - 1) for names in wings), default=0.0)
    width = max(_text_width(_short(place)), widest + 2 * MARGIN)
    return width, TITLE + len(wings) * (WING_HEIGHT + WING_GAP)


def _wings(house: House, room: str) -> Sequence[Sequence[str]]:
    """Return the short names of a room's wings, floor by floor."""
    floors = ([_short(name) for name in floor if house.is_room(name)] for floor in house.floors.get(room, ()))
    return [names for names in floors if names]


def _short(name: str) -> str:
    return name.rpartition(".")[2]


def _text_width(text: str) -> float:
    return LETTER * len(text) + 20.0


def _route(
    one: str, other: str, floors: Sequence[Sequence[_Place]], boxes: Mapping[_Place, _Box]
) -> list[tuple[float, float]]:
    """Return the points that an arrow goes through, each two on one floor, where it runs straight down."""
    first, *passed, last = (boxes[place] for place in _stops(one, other, floors))
    start, end = _leaving(first, (passed or [last])[0]), _leaving(last, (passed or [first])[-1])
    points = [(start, first.top + first.height), (start, first.lowest)]
    for gap in passed:
        points += [(gap.middle, gap.highest), (gap.middle, gap.lowest)]
    return [*points, (end, last.highest), (end, last.top)]


def _leaving(box: _Box, towards: _Box) -> float:
    """Return where along a box an arrow leaves or enters it: towards the other, away from the corners."""
    room = max(box.width / 2.0 - 2 * MARGIN, 0.0)
    return box.middle + min(max((towards.middle - box.middle) * 0.25, -room), room)


def _arrow(points: Sequence[tuple[float, float]]) -> str:
    path = f"M{points[0][0]:.1f} {points[0][1]:.1f}"
    for number, ((left, top), (x, y)) in enumerate(pairwise(points)):
        bend = (y - top) / 2.0
        if number % 2:
            path += f" C{left:.1f} {top + bend:.1f} {x:.1f} {y - bend:.1f} {x:.1f} {y:.1f}"
        elif y > top:
            path += f" L{x:.1f} {y:.1f}"
    return f'<path d="{path}" fill="none" stroke="{ARROW}" stroke-width="1.4" marker-end="url(#tip)"/>'


def _room(house: House, room: str, box: _Box) -> Iterator[str]:
    """Yield a room with its wings."""
    yield _labelled(_short(room), box, fill=ROOM_FILL, text=box.top + 20.0, bold=True)
    top = box.top + TITLE
    for names in _wings(house, room):
        widths = [_text_width(name) for name in names]
        left = box.middle - (sum(widths) + WING_GAP * (len(names) - 1)) / 2.0
        for name, width in zip(names, widths, strict=True):
            wing = _Box(left, top, width, WING_HEIGHT, box.highest, box.lowest)
            yield _labelled(name, wing, fill=WING_FILL, text=top + 16.5, bold=False)
            left += width + WING_GAP
        top += WING_HEIGHT + WING_GAP


def _labelled(name: str, box: _Box, *, fill: str, text: float, bold: bool) -> str:
    weight = ' font-weight="bold"' if bold else ""
    return (
        f'<rect x="{box.left:.1f}" y="{box.top:.1f}" width="{box.width:.1f}" height="{box.height:.1f}" rx="5" '
        f'fill="{fill}" stroke="{ARROW}"/><text x="{box.middle:.1f}" y="{text:.1f}" fill="{INK}"{weight}>{name}</text>'
    )
