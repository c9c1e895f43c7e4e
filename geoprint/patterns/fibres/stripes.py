"""Stripes: strokes that are level curves of a phase, as even as the field lets them be."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from geoprint.model import Surface
from geoprint.patterns.fibres.evened import evened, slopes_of
from geoprint.patterns.fibres.laying import SHORTEST, LaidStroke, Weave
from geoprint.patterns.fibres.levels import level_curves
from geoprint.patterns.fibres.net import LineNet
from geoprint.patterns.fibres.phase import Place, phase_of, target_of
from geoprint.patterns.fibres.rows import rows_of
from geoprint.patterns.fibres.senses import senses_of


def stripes(surface: Surface, net: LineNet, *, first: Place, through: bool) -> Weave:
    """Return the rows of a phase whose slopes follow the lines of a field.

    Args:
        surface: in one piece.
        net: of a field on it.
        first: where rows are counted from.
        through: a row shall pass there; otherwise rows are drawn to half a spacing from the rim.
    """
    senses = senses_of(surface, net)
    slopes = slopes_of(surface, net, senses)
    rim = np.zeros(len(surface.vertices), dtype=np.bool_)
    outer = np.flatnonzero(net.twins < 0)
    rim[surface.faces[outer // 3, outer % 3]] = True
    target = target_of(net, evened(slopes, rim, spacings=net.spacings))
    phase = phase_of(slopes, net, target, through=first if through else None)
    chains = level_curves(net, phase)
    rows = rows_of(surface, net, chains, first=first)
    strokes, dropped = list[LaidStroke](), list[float]()
    for row, (begin, end) in enumerate(pairwise(chains.offsets.tolist())):
        starts, ends = chains.starts[begin:end], chains.ends[begin:end]
        length = float(np.abs(ends - starts).sum())
        if length < SHORTEST * float(np.median(net.spacings[chains.faces[begin:end]])):
            dropped.append(length)
            continue
        closed = bool(chains.closed[row])
        strokes.append(LaidStroke(chains.faces[begin:end], starts, ends, closed, int(rows[row]), length))
    return Weave(strokes, dropped)
