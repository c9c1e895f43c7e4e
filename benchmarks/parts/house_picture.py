"""The house as a picture: rooms on their floors, wings inside them, arrows from what the code imports.

An arrow that follows from others is left out: who imports `pipeline` has `surfaces` below him anyway. Arrows that pass
a floor take a gap between its rooms; the order on each floor follows from what its rooms are joined to.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
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
# Sweeps over the floors in search of their order; nothing moves any more after four.
SWEEPS = 8

# What lies on a floor: a room by its name, or the gap that an arrow from one room to another takes on that floor.
_Place: TypeAlias = str | tuple[str, str, int]


@final
@dataclass(frozen=True, slots=True)
class _Box:
    """Where a room or gap lies: left, top, width, height."""

    left: float
    top: float
    width: float
    height: float

    @property
    def middle(self) -> float:
        return self.left + self.width / 2.0


def picture(house: House) -> str:
    """Return the house as an SVG file; the same house gives the same bytes."""
    arrows = reduced(_between_rooms(house))
    floors = _ordered(_with_gaps(house, arrows), arrows)
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


def _ordered(floors: list[list[_Place]], arrows: Mapping[str, Sequence[str]]) -> list[list[_Place]]:
    """Order each floor by where its neighbours above and below stand, over and over."""
    drawn = [_stops(one, other, floors) for one, others in arrows.items() for other in others]
    links = [link for stops in drawn for link in pairwise(stops)]
    for _ in range(SWEEPS):
        for number, floor in enumerate(floors):
            where = {place: (index + 0.5) / len(each) for each in floors for index, place in enumerate(each)}
            aims: dict[_Place, float] = {}
            for place in floor:
                beside = [where[b if a == place else a] for a, b in links if place in {a, b}]
                aims[place] = sum(beside) / len(beside) if beside else where[place]
            floors[number] = sorted(floor, key=aims.__getitem__)
    return floors


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
            found[place] = _Box(left, top + (height - own) / 2.0, sizes[place][0], own)
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
    """Return the points that an arrow goes through, in pairs of which each lies on one floor."""
    first, *passed, last = (boxes[place] for place in _stops(one, other, floors))
    points = [(_leaving(first, (passed or [last])[0]), first.top + first.height)]
    for gap in passed:
        points += [(gap.middle, gap.top), (gap.middle, gap.top + gap.height)]
    return [*points, (_leaving(last, (passed or [first])[-1]), last.top)]


def _leaving(box: _Box, towards: _Box) -> float:
    """Return where along a box an arrow leaves or enters it: towards the other, away from the corners."""
    room = max(box.width / 2.0 - 2 * MARGIN, 0.0)
    return box.middle + min(max((towards.middle - box.middle) * 0.25, -room), room)


def _arrow(points: Sequence[tuple[float, float]]) -> str:
    start, *rest = points
    path = f"M{start[0]:.1f} {start[1]:.1f}"
    before = start
    for number, (x, y) in enumerate(rest):
        bend = (y - before[1]) / 2.0
        path += (
            f" L{x:.1f} {y:.1f}"
            if number % 2
            else f" C{before[0]:.1f} {before[1] + bend:.1f} {x:.1f} {y - bend:.1f} {x:.1f} {y:.1f}"
        )
        before = x, y
    return f'<path d="{path}" fill="none" stroke="{ARROW}" stroke-width="1.4" marker-end="url(#tip)"/>'


def _room(house: House, room: str, box: _Box) -> Iterator[str]:
    """Yield a room with its wings."""
    yield _labelled(_short(room), box, fill=ROOM_FILL, text=box.top + 20.0, bold=True)
    top = box.top + TITLE
    for names in _wings(house, room):
        widths = [_text_width(name) for name in names]
        left = box.middle - (sum(widths) + WING_GAP * (len(names) - 1)) / 2.0
        for name, width in zip(names, widths, strict=True):
            yield _labelled(name, _Box(left, top, width, WING_HEIGHT), fill=WING_FILL, text=top + 16.5, bold=False)
            left += width + WING_GAP
        top += WING_HEIGHT + WING_GAP


def _labelled(name: str, box: _Box, *, fill: str, text: float, bold: bool) -> str:
    weight = ' font-weight="bold"' if bold else ""
    return (
        f'<rect x="{box.left:.1f}" y="{box.top:.1f}" width="{box.width:.1f}" height="{box.height:.1f}" rx="5" '
        f'fill="{fill}" stroke="{ARROW}"/><text x="{box.middle:.1f}" y="{text:.1f}" fill="{INK}"{weight}>{name}</text>'
    )
