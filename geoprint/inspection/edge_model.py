"""Both edges of beads in profiles across them, through a blur and a tone curve that nobody states.

A bead gives light back that varies smoothly from edge to edge, what it lies on gives back other light, and the lens
spreads both by one Gaussian. The camera writes a power of the light, its tone curve, cut off at white. Blur and tone
curve are those of the whole photograph, edges and light those of each profile; all are found together by least squares
[Bates1988], so that no step of grey values is an edge by itself. Where the rim of the part is seen, whose place is
known, it tells both apart from the shape of beads.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import comb
from typing import final

import numpy as np
from scipy import ndimage
from scipy.special import ndtr

from geoprint.inspection.profiles import BIN
from geoprint.model import FloatArray, IntArray, freeze_arrays, frozen

# Light on a bead varies as a polynomial of this degree from edge to edge.
DEGREE = 4
# Columns of what is fitted to a profile: both edges, light beside and its slope, the next edges, the polynomial.
_LEFT, _RIGHT, _BESIDE, _SLOPE, _NEXT_LEFT, _NEXT_RIGHT, _LIGHT = range(7)
COLUMNS = _LIGHT + DEGREE + 1
# How a bead's light varies from edge to edge, over what it adds to that beside it, as is thought beforehand (standard
# deviations): else a blurred profile would not tell a dark flank from a narrow bead.
VARIES = (1.0, 0.5, 0.4, 0.2, 0.2)
# Both flanks of a bead face away, and give back less by this share of the same.
FLANKS = -0.3
# The light beside a bead varies by this share over half of its width.
BESIDE_VARIES = 0.1
# The rim of a part is seen this near to where the camera has it (standard deviation) [pixels].
RIM_OFF = 0.1
# Tone curves of cameras, as exponents of light: those that are tried, and the flattest and steepest.
GAMMAS, LEAST_GAMMA, MOST_GAMMA = (1.2, 2.0), 1.0, 2.5
# Blurs that are looked for, and the one to begin with [pixels].
LEAST_BLUR, FIRST_BLUR, MOST_BLUR = 0.3, 1.5, 12.0
# Noise of a pixel as it is thought beforehand, and what the polynomial leaves of a bead's contrast.
NOISE, LEFT_SHARE = 0.01, 0.01
# Within a stretch an edge wanders by so much [pixels].
WANDERS = 0.2
# Steps of a fit, and what settles it [pixels].
MOST_STEPS, FEWER_STEPS, SETTLED = 40, 12, 2e-3
# No light is darker than this.
DARK = 1e-4
# A step moves an edge by no more than this, over half a width, blur by so much [pixels] and gamma by that share.
LONGEST, MOST_BLURRED, MOST_TONED = 0.2, 0.7, 0.15
NARROWEST = 0.2


@final
@frozen
class Rows:
    """Profiles across beads, k of n bins, or across the rim of the part, and where edges are thought to be.

    Attributes:
        asides: (k, n) [pixels].
        greys: (k, n) mean grey values.
        counts: (k, n) of pixels; 0 for what is left out.
        lefts: (k,) edge at the larger aside [pixels].
        rights: (k,) edge at the smaller; of a rim, far beyond the profile [pixels].
        inside: (k,) grey value between both.
        beside: (k,) grey value beside.
        next_lefts: (k,) where the next edge is beyond the left one, inf where none is near [pixels].
        next_rights: (k,) likewise, -inf [pixels].
        rims: (k,) 1 for what is the rim, 0 for a bead.
    """

    asides: FloatArray
    greys: FloatArray
    counts: FloatArray
    lefts: FloatArray
    rights: FloatArray
    inside: FloatArray
    beside: FloatArray
    next_lefts: FloatArray
    next_rights: FloatArray
    rims: IntArray

    def __post_init__(self) -> None:
        freeze_arrays(self, asides="float: k n", greys="float: k n", counts="float: k n", rims="int: k")

    def negative(self) -> Rows:
        """Return the same of the negative."""
        return replace(self, greys=1.0 - self.greys, inside=1.0 - self.inside, beside=1.0 - self.beside)

    def some(self, which: IntArray) -> Rows:
        """Return those of some numbers."""
        return Rows(*(getattr(self, name)[which] for name in Rows.__dataclass_fields__))


@final
@frozen
class Optics:
    """What a whole photograph has in common.

    Attributes:
        blur: standard deviation of the unsharpness [pixels].
        gamma: of the tone curve.
        spread: (2, 2) whose rows are how blur [pixels] and the logarithm of gamma move together (standard deviations).
        cost: sum of squares that is left, over the noise.
    """

    blur: float
    gamma: float
    spread: FloatArray
    cost: float

    def __post_init__(self) -> None:
        freeze_arrays(self, spread="float: 2 2")


@final
@frozen
class FittedEdges:
    """Edges of profiles.

    Attributes:
        lefts: (k,) at the larger aside [pixels].
        rights: (k,) at the smaller [pixels].
        deviations: (k, 2) of width and middle, by noise [pixels].
        common: (k, 2, 2) by how much width and middle move with the optics (standard deviations) [pixels].
        flanks: (k,) light that a bead adds at its darker edge, over that in its middle.
    """

    lefts: FloatArray
    rights: FloatArray
    deviations: FloatArray
    common: FloatArray
    flanks: FloatArray

    def __post_init__(self) -> None:
        freeze_arrays(
            self, lefts="float: k", rights="float: k", deviations="float: k 2", common="float: k 2 2",
            flanks="float: k",
        )  # fmt: skip


@final
@dataclass(frozen=True, slots=True)
class _State:
    """Values of the profiles, (k, c), lengths over half a width about the middle; blur and logarithm of gamma."""

    local: FloatArray
    optics: FloatArray


@final
class _Fit:
    """Least squares over profiles, whose values are apart but for blur and gamma."""

    def __init__(self, rows: Rows, gamma: float) -> None:
        self.rows = rows
        rim = rows.rims == 1
        self.middle = np.where(rim, rows.lefts, 0.5 * (rows.lefts + rows.rights))
        self.half = np.where(rim, 10.0, 0.5 * (rows.lefts - rows.rights))
        dark, light = (np.maximum(values, DARK) ** gamma for values in (rows.beside, rows.inside))
        added = np.maximum(np.abs(light - dark), 0.02)
        local = np.zeros((rim.size, COLUMNS))
        local[:, _LEFT] = np.where(rim, 0.0, 1.0)
        local[:, _RIGHT] = np.where(rim, -50.0, -1.0)
        local[:, _BESIDE], local[:, _LIGHT] = dark, light - dark
        local[:, _LIGHT + 2] = np.where(rim, 0.0, FLANKS * (light - dark))
        self.first = local
        stiff = np.zeros_like(local)
        stiff[:, _SLOPE] = 1.0 / (BESIDE_VARIES * np.maximum(dark, added))
        for power in range(1, DEGREE + 1):
            stiff[:, _LIGHT + power] = np.where(rim & (power > 1), 1e6, 1.0 / (VARIES[power] * added))
        stiff[rim, _LIGHT + 1] = 1.0 / (BESIDE_VARIES * np.maximum(dark, added)[rim])
        stiff[:, _LEFT] = np.where(rim, self.half / RIM_OFF, 0.0)
        stiff[rim, _RIGHT] = 1e6
        for column, places in ((_NEXT_LEFT, rows.next_lefts), (_NEXT_RIGHT, rows.next_rights)):
            stiff[:, column] = np.where(np.isfinite(places), 0.3 / added, 1e6)
        self.stiff = stiff
        self.u = (rows.asides - self.middle[:, None]) / self.half[:, None]
        contrast = np.abs(rows.inside - rows.beside)[:, None]
        counted = rows.counts > 0.0
        steep = ndimage.gaussian_filter1d(rows.greys, 1.0 / BIN, order=1, axis=1) / BIN
        noise = NOISE**2 / np.maximum(rows.counts, 1.0) + (LEFT_SHARE * contrast) ** 2 + (WANDERS * steep) ** 2
        self.weights = np.where(counted, 1.0 / noise, 0.0)

    def predicted(self, state: _State) -> tuple[FloatArray, FloatArray]:
        """Return (k, n) grey values and their (k, n, c + 2) slopes with what is fitted."""
        local, (blur, log_gamma) = state.local, state.optics.tolist()
        u, s = self.u, (blur / self.half)[:, None]
        high, low = local[:, _LEFT, None], local[:, _RIGHT, None]
        up, down = (high - u) / s, (low - u) / s
        bell_up, bell_down = (np.exp(-0.5 * z**2) / np.sqrt(2.0 * np.pi) for z in (up, down))
        moments: list[FloatArray] = [ndtr(up) - ndtr(down), bell_down - bell_up]
        for n in range(2, DEGREE + 2):
            moments.append((n - 1) * moments[n - 2] + down ** (n - 1) * bell_down - up ** (n - 1) * bell_up)
        light = local[:, _BESIDE, None] + local[:, _SLOPE, None] * u
        slopes = np.zeros((*u.shape, COLUMNS + 2))
        slopes[..., _BESIDE], slopes[..., _SLOPE] = 1.0, u
        at_high, at_low, blurred = np.zeros_like(high), np.zeros_like(low), np.zeros_like(u)
        for power in range(DEGREE + 1):
            share = local[:, _LIGHT + power, None]
            basis = _expected(u, s, moments, power)
            light = light + share * basis
            slopes[..., _LIGHT + power] = basis
            at_high, at_low = at_high + share * high**power, at_low + share * low**power
            if power:
                blurred = blurred + share * power * _expected(u, s, moments[1:], power - 1)
        for column, places, sign in (
            (_NEXT_LEFT, self.rows.next_lefts, 1.0),
            (_NEXT_RIGHT, self.rows.next_rights, -1.0),
        ):
            there = np.isfinite(places)
            next_edge: FloatArray = np.where(there, (places - self.middle) / self.half, 0.0)[:, None]
            beyond: FloatArray = np.asarray(ndtr(sign * (u - next_edge) / s), dtype=np.float64)
            slopes[..., column] = np.where(there[:, None], beyond, 0.0)
            light = light + local[:, column, None] * slopes[..., column]
        slopes[..., _LEFT], slopes[..., _RIGHT] = at_high * bell_up / s, -at_low * bell_down / s
        blurred = blurred + (at_low * bell_down * down - at_high * bell_up * up) / s
        slopes[..., COLUMNS] = blurred / self.half[:, None]
        gamma, lit = np.exp(log_gamma), np.maximum(light, DARK)
        grey: FloatArray = np.asarray(lit ** (1.0 / gamma), dtype=np.float64)
        steep: FloatArray = np.asarray(grey / (gamma * lit), dtype=np.float64)
        slopes[..., : COLUMNS + 1] *= np.where(light > DARK, steep, 0.0)[..., None]
        slopes[..., COLUMNS + 1] = -np.log(lit) * grey / gamma
        return grey, slopes

    def cost(self, state: _State, grey: FloatArray) -> float:
        """Return the sum of squares, with what is thought beforehand."""
        left = self.weights * (self.rows.greys - grey) ** 2
        return float(left.sum() + ((self.stiff * self._from_first(state)) ** 2).sum())

    def _from_first(self, state: _State) -> FloatArray:
        off = state.local.copy()
        for column in (_LEFT, _RIGHT, _LIGHT + 2):
            off[:, column] -= self.first[:, column]
        return off

    def normal(self, state: _State, grey: FloatArray, slopes: FloatArray) -> tuple[FloatArray, ...]:
        """Return normal matrices of the profiles, (k, c, c), with the optics, (k, c, 2) and (2, 2), and both sides."""
        weighted = self.weights[..., None] * slopes
        whole = np.matmul(weighted.transpose(0, 2, 1), slopes)
        side = np.einsum("knc,kn->kc", weighted, self.rows.greys - grey)
        own = whole[:, :COLUMNS, :COLUMNS].copy()
        diagonal = np.arange(COLUMNS)
        own[:, diagonal, diagonal] += self.stiff**2 + 1e-6
        return (
            own, whole[:, :COLUMNS, COLUMNS:], whole[:, COLUMNS:, COLUMNS:].sum(axis=0),
            side[:, :COLUMNS] - self.stiff**2 * self._from_first(state), side[:, COLUMNS:].sum(axis=0),
        )  # fmt: skip

    def settled(self, state: _State, *, fixed: bool) -> _State:
        """Return where the sum of squares is least, by steps that are the shorter the worse they turn out."""
        damping = 1e-2
        grey, slopes = self.predicted(state)
        cost = self.cost(state, grey)
        for _ in range(FEWER_STEPS if fixed else MOST_STEPS):
            normal = self.normal(state, grey, slopes)
            for _ in range(6):
                tried = _stepped(state, normal, damping, fixed=fixed)
                new_grey, new_slopes = self.predicted(tried)
                new_cost = self.cost(tried, new_grey)
                if new_cost < cost:
                    break
                damping *= 5.0
            else:
                return state
            moved = np.abs((tried.local - state.local)[:, :2] * self.half[:, None]).max()
            moved = max(float(moved), float(np.abs(tried.optics - state.optics).max()))
            gained, state, grey, slopes, cost = cost - new_cost, tried, new_grey, new_slopes, new_cost
            damping = max(damping / 5.0, 1e-7)
            if moved < SETTLED or gained < 1e-5 * cost:
                return state
        return state


def _flanks(local: FloatArray) -> FloatArray:
    """Return the (k,) light that beads add at their darker edges, over that in the middle, which is white at most."""
    powers, edges = np.arange(DEGREE + 1), local[:, [_LEFT, _RIGHT]]
    middle = edges.mean(axis=1, keepdims=True)
    added = (local[:, None, _LIGHT:] * np.hstack([edges, middle])[:, :, None] ** powers).sum(axis=2)
    middle_added = np.minimum(added[:, 2], 1.0 - local[:, _BESIDE])
    steady = np.where(np.abs(middle_added) < DARK, DARK, middle_added)
    return np.asarray((added[:, :2] / steady[:, None]).min(axis=1), dtype=np.float64)


def _expected(u: FloatArray, s: FloatArray, moments: list[FloatArray], power: int) -> FloatArray:
    """Return the (k, n) blurred power of the place, from the moments of what the blur takes in."""
    result = np.zeros_like(u)
    for j in range(power + 1):
        result += float(comb(power, j)) * u ** (power - j) * s**j * moments[j]
    return result


def _stepped(state: _State, normal: tuple[FloatArray, ...], damping: float, *, fixed: bool) -> _State:
    own, mixed, shared, side, shared_side = normal
    damped = own.copy()
    diagonal = np.arange(COLUMNS)
    damped[:, diagonal, diagonal] *= 1.0 + damping
    right = np.concatenate([side[..., None], mixed], axis=2)
    moved: FloatArray = np.asarray(np.linalg.solve(damped, right), dtype=np.float64)
    step, optics = moved[..., 0], state.optics
    if not fixed:
        inner: FloatArray = shared * (1.0 + damping * np.eye(2)) - np.einsum("kci,kcj->ij", mixed, moved[..., 1:])
        pulled = shared_side - np.einsum("kci,kc->i", mixed, step)
        solved: FloatArray = np.asarray(np.linalg.solve(inner + 1e-9 * np.eye(2), pulled), dtype=np.float64)
        common: FloatArray = np.clip(solved, [-MOST_BLURRED, -MOST_TONED], [MOST_BLURRED, MOST_TONED])
        step = step - moved[..., 1:] @ common
        optics = np.clip(
            optics + common, [LEAST_BLUR, np.log(LEAST_GAMMA)], [MOST_BLUR, np.log(MOST_GAMMA)]
        )  # fmt: skip
    local = state.local + step
    local[:, :2] = state.local[:, :2] + np.clip(step[:, :2], -LONGEST, LONGEST)
    narrow = local[:, _LEFT] - local[:, _RIGHT] < NARROWEST
    local[narrow, :2] = state.local[narrow, :2]
    return replace(state, local=local, optics=optics)


def found_optics(rows: Rows) -> Optics:
    """Return blur and tone curve of the photograph that profiles are of.

    Args:
        rows: some of its profiles.
    """
    tried: list[Optics] = []
    for gamma in GAMMAS:
        fit = _Fit(rows, gamma)
        state = fit.settled(_State(fit.first, np.array([FIRST_BLUR, np.log(gamma)])), fixed=False)
        grey, slopes = fit.predicted(state)
        cost = fit.cost(state, grey)
        own, mixed, shared, _, _ = fit.normal(state, grey, slopes)
        inner: FloatArray = shared - np.einsum("kci,kcj->ij", mixed, np.linalg.solve(own, mixed)) + 1e-6 * np.eye(2)
        more = max(1.0, cost / max(float((rows.counts > 0.0).sum()), 1.0))
        spread: FloatArray = np.asarray(np.linalg.cholesky(np.linalg.inv(inner) * more), dtype=np.float64)
        tried.append(Optics(float(state.optics[0]), float(np.exp(state.optics[1])), spread, cost))
    return min(tried, key=lambda each: each.cost)


def fitted_edges(rows: Rows, optics: Optics) -> FittedEdges:
    """Return the edges of profiles, once blur and tone curve are known.

    Args:
        rows: profiles.
        optics: of their photograph.
    """
    fit = _Fit(rows, optics.gamma)
    state = fit.settled(_State(fit.first, np.array([optics.blur, np.log(optics.gamma)])), fixed=True)
    grey, slopes = fit.predicted(state)
    own, mixed, _, _, _ = fit.normal(state, grey, slopes)
    counted = np.maximum((rows.counts > 0.0).sum(axis=1), 1)
    off = np.sqrt((fit.weights * (rows.greys - grey) ** 2).sum(axis=1) / counted)
    # Width and middle of both edges.
    to_both = np.array([[1.0, -1.0], [0.5, 0.5]])
    covariance = to_both @ np.linalg.inv(own)[:, :2, :2] @ to_both.T
    noise = np.sqrt(np.maximum(np.einsum("kii->ki", covariance), 0.0)) * np.maximum(off, 1.0)[:, None]
    moved = -np.linalg.solve(own, mixed)[:, :2] @ optics.spread
    edges = state.local[:, :2] * fit.half[:, None] + fit.middle[:, None]
    return FittedEdges(
        edges[:, 0], edges[:, 1], noise * fit.half[:, None], to_both @ moved * fit.half[:, None, None],
        _flanks(state.local),
    )  # fmt: skip
