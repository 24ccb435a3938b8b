"""Reference states of an elastica between two walls, to 22 significant digits.

The script draws random loads and wall distances, solves each equilibrium with elliptic integrals
at 60 working digits, and computes the four lowest eigenvalues of the second variation with moving
contacts. It is written from the formulas alone and imports nothing from the package, so its
numbers can serve as an independent reference for it.

Equilibrium
    Unknown curvature ``kappa`` shared by clamps and contacts, and one ``lam`` per distinct kind of
    segment. A scan over ``kappa`` in double precision finds the root (the smallest one where there
    are several), Newton's method refines it. Each segment is then integrated once as an initial
    value problem by Taylor series, which must reproduce the angle, the curvature, the rise and the
    advance at its end.

Eigenvalues
    -phi'' - (p cos theta + lam sin theta) phi = mu phi + c cos theta on every segment, with phi = 0
    at clamps, phi' = 0 at pins, one constraint (integral of cos theta phi = 0) per segment, and a
    jump of phi' by (reaction / kappa) phi at a point contact. In the line regime phi vanishes at
    the contact's ends and the segments stand alone. A Legendre-Galerkin discretisation gives the
    number and the order of the eigenvalues and their first dozen digits; the secant method on a
    characteristic determinant, built from Taylor series in fixed-point arithmetic, gives the rest.

Conventions of a record
    ``lam`` and ``lengths`` hold one entry per free segment, from end A to end B, each ``lam`` with
    the segment followed from its outer end and rising. A free shape is one segment; it starts at a
    clamp with curvature -kappa (B1) or +kappa (B2), or at the pin of a strip with one pin, at the
    lower (B1) or upper (B2) turning point of the pendulum. Free pinned-pinned shapes have no clamp:
    their ``kappa`` is the curvature where theta = 0. ``a`` to the left (right) of the U says that
    the segment at end A (B) is of kind A; a trailing minus says line regime, where ``kappa`` is 0,
    ``reaction`` the sum of the forces at the two ends of the line, and ``contact_position`` the arc
    length where the line begins. The walls play no part in a free shape, and whether a state is
    admissible (pulling contacts, walls penetrated) is not examined.

Run ``python make_states.py`` to write ``states.json`` beside the script, and
``python make_states.py --check`` to test its numbers by other means.
"""

import argparse
import json
import math
import random
import sys
import time
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from operator import mul
from pathlib import Path

import mpmath
import numpy as np
from mpmath import mp, mpf
from numpy.polynomial import legendre
from scipy import integrate, linalg, special

DIGITS = 22
WORKING_DIGITS = 60
BITS = 208
ORDER = 58
SEED = 20240607
COUNT = 1000
EIGENVALUES = 4

ENDS = ("clamped-clamped", "clamped-pinned", "pinned-clamped", "pinned-pinned")
COMMON = ("B1", "B2", "U", "Ua", "aUa", "U-")
STATES = {
    "clamped-clamped": COMMON,
    "clamped-pinned": (*COMMON, "aU", "Ua-"),
    "pinned-clamped": (*COMMON, "aU", "aU-"),
    "pinned-pinned": (*COMMON, "Ua-", "aUa-"),
}
P_RANGE = (0.05, 12.0)
H_RANGE = (0.01, 0.2)
MAX_SLOPE = math.pi / 2
SCAN_SLOPE = math.radians(94.0)  # the scan reaches a little beyond the slopes that are accepted


# ------------------------------------------------------------------------------------- segments
@dataclass(frozen=True)
class Kind:
    """Kind of a segment, followed from its outer end.

    Attributes
    ----------
    end : str
        "clamped" or "pinned", the outer end.
    letter : str
        "S" or "A", or "N" for a free pinned-pinned shape.
    more : int
        Number of further full periods ("S", "A"), or the number of half periods ("N").
    """

    end: str
    letter: str
    more: int = 0

    def multiples(self):
        """Multiples of the complete and incomplete integrals, and of kappa.

        Returns
        -------
        a, b, q : int
            The elliptic integrals over the segment are aK + bf and aE + be, and the curvatures at
            its two ends differ by q kappa.
        """
        if self.letter == "N":
            return 2 * self.more, 0, 0
        a, b, q = {
            ("clamped", "S"): (2, 2, 2),
            ("clamped", "A"): (4, 0, 0),
            ("pinned", "S"): (1, 1, 1),
            ("pinned", "A"): (3, 1, 1),
        }[self.end, self.letter]
        return a + 4 * self.more, b, q

    @property
    def two_sided(self):
        """Whether the segment passes both turning points of the pendulum."""
        return self.letter != "S" or self.more > 0


class _Multiprecision:
    """Special functions of mpmath under the names used by `measure`."""

    sqrt, sin, cos, asin, atan2 = mp.sqrt, mp.sin, mp.cos, mp.asin, mp.atan2
    K, E, Finc, Einc = mp.ellipk, mp.ellipe, mp.ellipf, mp.ellipe


class _Double:
    """Special functions of numpy and scipy under the names used by `measure`."""

    sqrt, sin, cos, asin, atan2 = np.sqrt, np.sin, np.cos, np.arcsin, np.arctan2
    K, E, Finc, Einc = special.ellipk, special.ellipe, special.ellipkinc, special.ellipeinc


def measure(kind, kappa, lam, p, fn=_Multiprecision):
    """Length, rise and advance of a segment.

    Parameters
    ----------
    kind : Kind
        Kind of the segment.
    kappa, lam, p : mpf or float or ndarray
        Curvature where theta = 0, transverse force, thrust (EI = L = 1).
    fn : type
        Namespace of the special functions.

    Returns
    -------
    tuple
        Length, rise and advance.
    """
    a, b, q = kind.multiples()
    force = fn.sqrt(p * p + lam * lam)
    alpha = fn.atan2(lam, p)
    r = fn.sqrt(force)
    half = fn.sin(alpha / 2)
    m = kappa * kappa / (4 * force) + half * half
    big_k, big_e = fn.K(m), fn.E(m)
    delta_f, delta_e = a * big_k, a * big_e
    if b:
        phase = fn.atan2(2 * r * half, kappa)
        delta_f = delta_f + b * fn.Finc(phase, m)
        delta_e = delta_e + b * fn.Einc(phase, m)
    length = delta_f / r
    along = 2 * delta_e / r - length
    across = q * kappa / force
    rise = fn.cos(alpha) * across + fn.sin(alpha) * along
    advance = fn.cos(alpha) * along - fn.sin(alpha) * across
    return length, rise, advance


def steepest(kind, kappa, lam, p, fn=_Multiprecision):
    """Greatest ``|theta|`` on a segment."""
    force = fn.sqrt(p * p + lam * lam)
    alpha = fn.atan2(lam, p)
    m = kappa * kappa / (4 * force) + fn.sin(alpha / 2) ** 2
    swing = 2 * fn.asin(fn.sqrt(m))
    return abs(alpha) + swing if kind.two_sided else alpha + swing


def end_values(kind, kappa, lam, p):
    """Angle and curvature at the start of a segment, and at its end."""
    alpha = mp.atan2(lam, p)
    swing = 2 * mp.asin(mp.sqrt(kappa * kappa / (4 * mp.hypot(p, lam)) + mp.sin(alpha / 2) ** 2))
    if kind.letter == "N":
        return (swing, mpf(0)), ((-1) ** kind.more * swing, mpf(0))
    if kind.end == "clamped":
        start = (mpf(0), kappa if kind.letter == "S" else -kappa)
    else:
        start = (alpha + swing if kind.letter == "S" else alpha - swing, mpf(0))
    return start, (mpf(0), -kappa)


# ------------------------------------------------------------------------- search in double
def _alpha_of_kappa(kind, kappa, p, rise):
    """Direction of the force at which a segment has the given rise, for an array of curvatures.

    The rise grows with the force's direction for slopes below 90 degrees, so one bracketed root
    is all there is. The result is nan where it does not exist.
    """
    top = np.arctan((1 - kappa**2 / (2 * p) - math.cos(SCAN_SLOPE)) / math.sin(SCAN_SLOPE))
    low = -np.abs(top) if kind.two_sided else np.full_like(kappa, -math.pi / 2 + 1e-7)
    ok = (top > low) if not kind.two_sided else (top > 0)
    low, top = np.where(ok, low, np.nan), np.where(ok, top, np.nan)

    def excess(alpha):
        return measure(kind, kappa, p * np.tan(alpha), p, _Double)[1] - rise

    f_low, f_top = excess(low), excess(top)
    ok = ok & (f_low <= 0) & (f_top >= 0)
    low, top = np.where(ok, low, np.nan), np.where(ok, top, np.nan)
    side = np.zeros_like(kappa)  # the end that moved last: +1 upper, -1 lower
    for count in range(120):  # false position (Illinois), every fourth step a bisection
        middle = (low + top) / 2
        if count % 4 != 3:
            trial = top - f_top * (top - low) / (f_top - f_low)
            middle = np.where((trial >= low) & (trial <= top), trial, middle)
        f = excess(middle)
        above = f > 0
        f_low, f_top = (
            np.where(above, np.where(side > 0, f_low / 2, f_low), f),
            np.where(above, f, np.where(side < 0, f_top / 2, f_top)),
        )
        low, top = np.where(above, low, middle), np.where(above, middle, top)
        side = np.where(above, 1, -1)
        if np.all(~ok | (np.abs(f) < 1e-15) | (top - low < 1e-15)):
            break
    return np.where(ok, middle, np.nan)


def _excess_length(kinds, kappa, p, rise):
    """Total length minus one, for an array of curvatures."""
    lengths = {}
    for kind in set(kinds):
        lam = p * np.tan(_alpha_of_kappa(kind, kappa, p, rise))
        lengths[kind] = measure(kind, kappa, lam, p, _Double)[0]
    return sum(lengths[kind] for kind in kinds) - 1


def _roots(function, grid):
    """Roots of a function on a grid in ascending order, to double precision.

    Between grid points a pair of roots may hide where the function comes close to zero; such
    places are scanned again on a finer grid.
    """
    values = function(grid)
    size = np.abs(values)
    brackets = []
    for i in range(len(grid) - 1):
        if values[i] * values[i + 1] <= 0:
            brackets.append((grid[i], grid[i + 1]))
        elif i and values[i - 1] * values[i] > 0 and size[i] <= min(size[i - 1], size[i + 1]):
            fine = np.linspace(grid[i - 1], grid[i + 1], 101)
            nearby = function(fine)
            change = np.flatnonzero(nearby[:-1] * nearby[1:] <= 0)
            brackets += [(fine[k], fine[k + 1]) for k in change]
    for low, top in sorted(brackets):
        for _ in range(12):
            fine = np.linspace(low, top, 25)
            values = function(fine)
            change = np.flatnonzero(values[:-1] * values[1:] <= 0)
            if len(change) == 0 or top - low < 4e-15 * top:
                break
            low, top = fine[change[0]], fine[change[0] + 1]
        yield (low + top) / 2


def layout(state, ends):
    """Kinds of the free segments of a state, from end A to end B, and its regime.

    Parameters
    ----------
    state : str
        B1, B2, U, aU, Ua, aUa, or one of the last four with a minus.
    ends : str
        One of `ENDS`.

    Returns
    -------
    kinds : tuple of Kind
        One kind for a free shape, two otherwise.
    regime : str
        "free", "point" or "line".
    """
    if state not in STATES[ends]:
        raise ValueError(f"no state {state!r} with ends {ends!r}")
    left, right = ends.split("-")
    if state in ("B1", "B2"):
        mode = int(state[1])
        if left == right == "pinned":
            return (Kind("pinned", "N", mode),), "free"
        if left == right:
            return (Kind("clamped", "A") if mode == 1 else Kind("clamped", "S", 1),), "free"
        return (Kind("pinned", "A") if mode == 1 else Kind("pinned", "S", 1),), "free"
    word = state.rstrip("-")
    kinds = (
        Kind(left, "A" if word.startswith("a") else "S"),
        Kind(right, "A" if word.endswith("a") else "S"),
    )
    return kinds, "line" if state.endswith("-") else "point"


def _grid(kinds, p, H, density=1):
    """Curvatures to scan for a state."""
    if any(kind.two_sided for kind in kinds):
        top = limit = math.sqrt(2 * p * (1 - math.cos(SCAN_SLOPE)))
    else:
        limit = 6 / H  # beyond, two segments of rise H are shorter than the strip
        top = min(limit, 2 * math.sqrt(p) + 50 * H)
    grid = np.linspace(0, top, 300 * density + 1)[1:]
    parts = [np.geomspace(1e-5, grid[0], 20)[:-1], grid]
    if limit > top:
        parts.append(np.geomspace(top, limit, 80 * density)[1:])
    return np.concatenate(parts)


def locate(state, ends, P, H, density=1):
    """Find a state in double precision.

    Parameters
    ----------
    state, ends : str
        The state's name and its end conditions.
    P, H : float
        Dimensionless load and wall distance.
    density : int
        Factor on the number of curvatures scanned.

    Returns
    -------
    tuple or None
        Curvature and, per distinct kind of segment, its ``lam``; None if there is no such state
        with slopes below 90 degrees.
    """
    kinds, regime = layout(state, ends)
    p = 4 * math.pi**2 * P
    distinct = tuple(dict.fromkeys(kinds))
    if distinct[0].letter == "N" or (state == "B1" and ends == "clamped-clamped"):
        full = distinct[0].multiples()[0]
        if not full * special.ellipk(0) < math.sqrt(p) < full * special.ellipk(0.5):
            return None
        low, top = 0.0, 0.5
        for _ in range(60):
            middle = (low + top) / 2
            low, top = (middle, top) if full * special.ellipk(middle) < math.sqrt(p) else (low, middle)
        return 2 * math.sqrt(low * p), (0.0,)
    rise = 0.0 if regime == "free" else H
    with np.errstate(all="ignore"):
        if regime == "line":
            candidates = [0.0]
        else:
            grid = _grid(kinds, p, H, density)
            candidates = _roots(lambda x: _excess_length(kinds, x, p, rise), grid)
        for kappa in candidates:
            alphas = [_alpha_of_kappa(k, np.array([kappa]), p, rise)[0] for k in distinct]
            lams = tuple(p * math.tan(alpha) for alpha in alphas)
            known = dict(zip(distinct, lams, strict=True))
            slopes = [steepest(k, kappa, lam, p, _Double) for k, lam in known.items()]
            total = sum(measure(k, kappa, known[k], p, _Double)[0] for k in kinds)
            if all(slope < MAX_SLOPE for slope in slopes) and (regime != "line" or total <= 1):
                return kappa, lams
    return None


# --------------------------------------------------------------------------------- refinement
def _newton(function, start, tolerance):
    """Newton's method with a difference quotient in multiprecision."""
    x = mpmath.matrix(start)
    step = mpf(10) ** (-mp.dps // 2)
    for _ in range(12):
        f = mpmath.matrix(function(*x))
        jacobian = mpmath.matrix(len(x), len(x))
        for j in range(len(x)):
            shifted = x.copy()
            width = step * max(1, abs(x[j]))
            shifted[j] += width
            column = (mpmath.matrix(function(*shifted)) - f) / width
            for i in range(len(x)):
                jacobian[i, j] = column[i]
        change = mpmath.lu_solve(jacobian, f)
        x -= change
        if max(abs(c) / max(1, abs(v)) for c, v in zip(change, x, strict=True)) < tolerance:
            return list(x)
    raise ArithmeticError("Newton's method did not converge")


@dataclass
class Segment:
    """A solved segment: its kind, force, length, rise, advance, and Taylor series."""

    kind: Kind
    lam: mpf
    length: mpf
    rise: mpf
    advance: mpf
    series: "Series"


def equilibrium(state, ends, P, H):
    """Solve for a state at 60 digits.

    Parameters
    ----------
    state, ends : str
        The state's name and its end conditions.
    P, H : float
        Dimensionless load and wall distance.

    Returns
    -------
    kappa, p : mpf
        Curvature and thrust.
    segments : list of Segment
        Free segments from end A to end B.
    """
    start = locate(state, ends, P, H)
    if start is None:
        raise ValueError(f"no state {state} {ends} at P={P!r}, H={H!r}")
    kinds, regime = layout(state, ends)
    distinct = tuple(dict.fromkeys(kinds))
    p = 4 * mp.pi**2 * mpf(P)
    rise = mpf(0) if regime == "free" else mpf(H)
    tolerance = mpf(10) ** (8 - mp.dps)
    guess_kappa, guess_lams = start
    if guess_lams == (0.0,):
        full = distinct[0].multiples()[0]
        (m,) = _newton(
            lambda m: [full * mp.ellipk(m) - mp.sqrt(p)],
            [mpf(guess_kappa) ** 2 / (4 * p)],
            tolerance,
        )
        kappa, lams = 2 * mp.sqrt(m * p), [mpf(0)]
    elif regime == "line":
        kappa = mpf(0)
        lams = [
            _newton(lambda x, k=k: [measure(k, kappa, x, p)[1] - rise], [mpf(lam)], tolerance)[0]
            for k, lam in zip(distinct, guess_lams, strict=True)
        ]
    else:

        def residual(kappa, *lams):
            found = {k: measure(k, kappa, x, p) for k, x in zip(distinct, lams, strict=True)}
            return [sum(found[k][0] for k in kinds) - 1] + [found[k][1] - rise for k in distinct]

        kappa, *lams = _newton(residual, [mpf(guess_kappa), *map(mpf, guess_lams)], tolerance)
    moved = [abs(kappa - guess_kappa) / max(1, kappa)]
    moved += [abs(x - y) / max(1, abs(x)) for x, y in zip(lams, guess_lams, strict=True)]
    if max(moved) > 1e-6:
        raise ArithmeticError(f"refinement moved away from its start: {state} {ends} {P!r} {H!r}")
    solved = {}
    for kind, lam in zip(distinct, lams, strict=True):
        length, up, advance = measure(kind, kappa, lam, p)
        series = Series(kind, kappa, lam, p, length)
        series.verify(kind, kappa, lam, p, up, advance)
        solved[kind] = Segment(kind, lam, length, up, advance, series)
    return kappa, p, [solved[kind] for kind in kinds]


# ------------------------------------------------------------------------- Taylor integration
class Series:
    """Taylor series of cos theta and sin theta along a segment, in fixed-point integers.

    Parameters
    ----------
    kind : Kind
        Kind of the segment.
    kappa, lam, p, length : mpf
        Its solution.
    bits : int
        Number of binary places.
    order : int
        Number of Taylor coefficients.
    """

    def __init__(self, kind, kappa, lam, p, length, bits=BITS, order=ORDER):
        self.bits, self.order = bits, order
        alpha = mp.atan2(lam, p)
        m = kappa * kappa / (4 * mp.hypot(p, lam)) + mp.sin(alpha / 2) ** 2
        radius = mp.ellipk(1 - m) / mp.sqrt(mp.hypot(p, lam))  # distance of the nearest pole
        steps = max(1, math.ceil(length / radius * 10 ** (0.28 * bits / order)))
        while not self._integrate(kind, kappa, lam, p, length, steps):
            steps = math.ceil(1.25 * steps)

    def fixed(self, x):
        """Convert to a fixed-point integer."""
        return int(mp.nint(mp.ldexp(x, self.bits)))

    def real(self, n):
        """Convert a fixed-point integer to mpf."""
        return mp.ldexp(mpf(n), -self.bits)

    def _integrate(self, kind, kappa, lam, p, length, steps):
        """Integrate theta'' = -p sin theta + lam cos theta; False if the series end too early."""
        bits, order = self.bits, self.order
        start, _ = end_values(kind, kappa, lam, p)
        self.clamped = kind.end == "clamped"
        width = length / steps
        self.width = self.fixed(width)
        force_x, force_y = self.fixed(width * width * p), self.fixed(width * width * lam)
        theta, slope = self.fixed(start[0]), self.fixed(start[1] * width)
        sine, cosine = self.fixed(mp.sin(start[0])), self.fixed(mp.cos(start[0]))
        self.pieces, rise, advance = [], 0, 0
        for _ in range(steps):
            t, dt, s, c = [theta, slope], [slope], [sine], [cosine]
            for k in range(order):
                last = (force_y * c[k] - force_x * s[k] >> bits) // ((k + 1) * (k + 2))
                s_next = sum(map(mul, dt, reversed(c))) // (k + 1) >> bits
                c_next = -sum(map(mul, dt, reversed(s))) // (k + 1) >> bits
                s.append(s_next)
                c.append(c_next)
                t.append(last)
                dt.append((k + 2) * last)
            if max(map(abs, (*s[-2:], *c[-2:]))) >> 24:
                return False
            # coefficients of h^2 (p cos theta + lam sin theta) and of h^2 cos theta, reversed
            potential = [force_x * x + force_y * y >> bits for x, y in zip(c, s, strict=True)]
            load = [(self.width * self.width * x) >> (2 * bits) for x in c]
            self.pieces.append((potential[order - 1 :: -1], load, c[order - 1 :: -1]))
            rise += self.width * sum(x // (k + 1) for k, x in enumerate(s)) >> bits
            advance += self.width * sum(x // (k + 1) for k, x in enumerate(c)) >> bits
            theta, slope, sine, cosine = sum(t), sum(dt), sum(s), sum(c)
        self.end = (self.real(theta), self.real(slope) / width, self.real(rise), self.real(advance))
        return True

    def verify(self, kind, kappa, lam, p, rise, advance):
        """Compare the integrated end values with those of the elliptic integrals."""
        _, (theta, curvature) = end_values(kind, kappa, lam, p)
        error = max(abs(x - y) for x, y in zip(self.end, (theta, curvature, rise, advance), strict=True))
        if error > mpf(2) ** (40 - self.bits):
            raise ArithmeticError(f"shape and elliptic integrals differ by {mp.nstr(error, 3)}")
        return error

    def response(self, mu):
        """Solve the eigenvalue equation from the segment's outer end under its constraint.

        Parameters
        ----------
        mu : mpf
            Trial eigenvalue.

        Returns
        -------
        phi, slope : mpf
            Value and derivative at the other end, of the combination of the homogeneous and the
            particular solution whose product with cos theta has a vanishing integral.
        """
        bits, order, width = self.bits, self.order, self.width
        one = 1 << bits
        u, du = (0, width) if self.clamped else (one, 0)  # derivatives are times the step
        w, dw, integral = 0, 0, 0
        shift = self.fixed(mu) * width * width >> (2 * bits)
        for potential, load, cosine in self.pieces:
            kernel = potential.copy()
            kernel[-1] += shift
            uu, ww = [u, du], [w, dw]
            for k in range(order - 1):
                part = kernel[order - 1 - k :]
                divisor = (k + 1) * (k + 2)
                uu.append((-sum(map(mul, part, uu)) >> bits) // divisor)
                ww.append(((-sum(map(mul, part, ww)) >> bits) - load[k]) // divisor)
            u, w = sum(uu), sum(ww)
            du = sum(map(mul, range(order + 1), uu))
            dw = sum(map(mul, range(order + 1), ww))
            integral += sum(sum(map(mul, cosine[order - 1 - k :], ww)) // (k + 1) for k in range(order))
        integral_w = self.real(integral * width >> (2 * bits))
        u, w = self.real(u), self.real(w)
        step = self.real(width)
        du, dw = self.real(du) / step, self.real(dw) / step
        # Lagrange's identity: the integral of cos theta u, as w and w' vanish at the outer end
        integral_u = w * du - dw * u
        return integral_w * u - integral_u * w, integral_w * du - integral_u * dw


# --------------------------------------------------------------------------------- eigenvalues
@dataclass
class Problem:
    """An eigenvalue problem on one segment, or on two that meet in a contact.

    Attributes
    ----------
    segments : list of Segment
        Followed from their outer ends.
    spring : mpf or None
        Stiffness against phi at the common (or only) inner end; None if phi = 0 there.
    exact_zero : bool
        Whether phi = theta' is an eigenfunction with eigenvalue zero.
    """

    segments: list
    spring: mpf | None
    exact_zero: bool = False

    def determinant(self, mu):
        """Characteristic function, zero at the eigenvalues."""
        found = [segment.series.response(mu) for segment in self.segments]
        if self.spring is None:
            return found[0][0]
        if len(found) == 1:
            ((phi, slope),) = found
            return slope + self.spring * phi
        (phi, slope), (phi_2, slope_2) = found
        return slope * phi_2 + slope_2 * phi + self.spring * phi * phi_2


def problems(state, ends, kappa, segments, split=True):
    """Independent eigenvalue problems whose spectra together are that of the state.

    Parameters
    ----------
    state, ends : str
        The state's name and its end conditions.
    kappa : mpf
        Curvature.
    segments : list of Segment
        Free segments.
    split : bool
        Whether to separate a symmetric state's even and odd functions.

    Returns
    -------
    list of Problem
        The problems.
    """
    _, regime = layout(state, ends)
    if regime == "free":
        inner = mpf(0) if ends == "pinned-pinned" else None
        return [Problem(segments, inner)]
    if regime == "line":
        return [Problem([s], None, s.kind.end == "clamped") for s in segments]
    spring = sum(s.lam for s in segments) / kappa
    if split and segments[0].kind == segments[1].kind:
        return [Problem(segments[:1], spring / 2), Problem(segments[:1], None)]
    return [Problem(segments, spring)]


@lru_cache
def _legendre(size):
    """Hat and bubble functions on [-1, 1], their derivatives, nodes and weights."""
    x, weights = legendre.leggauss(2 * size + 16)
    values = legendre.legvander(x, size + 1)
    k = np.arange(1, size + 1)
    bubbles = (values[:, 2:] - values[:, :-2]) / np.sqrt(2 * (2 * k + 1))
    slopes = np.sqrt((2 * k + 1) / 2) * values[:, 1:-1]
    hats = np.column_stack([(1 - x) / 2, (1 + x) / 2])
    hat_slopes = np.broadcast_to([-0.5, 0.5], hats.shape)
    return x, weights, np.hstack([hats, bubbles]), np.hstack([hat_slopes, slopes])


def _profile(segment, kappa, p, s):
    """Weights p cos theta + lam sin theta and cos theta at arc lengths s, from Jacobi functions."""
    lam = float(segment.lam)
    force, alpha = math.hypot(p, lam), math.atan2(lam, p)
    m = kappa**2 / (4 * force) + math.sin(alpha / 2) ** 2
    phase = math.pi / 2
    if segment.kind.end == "clamped":
        phase = -math.atan2(2 * math.sqrt(force) * math.sin(alpha / 2), kappa)
    start = special.ellipkinc(phase, m)
    if segment.kind.letter == "A":
        start = -start if segment.kind.end == "pinned" else -2 * special.ellipk(m) - start
    sn, _, dn, _ = special.ellipj(start + math.sqrt(force) * s, m)
    cosine = math.cos(alpha) * (1 - 2 * m * sn**2) - math.sin(alpha) * 2 * math.sqrt(m) * sn * dn
    return force * (1 - 2 * m * sn**2), cosine


def _lowest(stiffness, mass, constraints, count):
    """Lowest eigenvalues of a symmetric pencil under linear constraints."""
    basis = linalg.null_space(constraints)
    return linalg.eigh(basis.T @ stiffness @ basis, basis.T @ mass @ basis, eigvals_only=True)[:count]


def galerkin(problem, kappa, p, count=EIGENVALUES, size=44):
    """Lowest eigenvalues of a problem from a Legendre basis, in double precision."""
    kappa, p = float(kappa), float(p)
    x, weights, values, slopes = _legendre(size)
    number = len(problem.segments)
    total = number * (size + 1) + 1  # per segment its outer hat and bubbles; the inner hat last
    stiffness, mass = np.zeros((2, total, total))
    constraints = np.zeros((number, total))
    keep = np.ones(total, bool)
    for j, segment in enumerate(problem.segments):
        length = float(segment.length)
        first = j * (size + 1)
        index = np.array([first, total - 1, *range(first + 1, first + size + 1)])
        potential, cosine = _profile(segment, kappa, p, (1 + x) * length / 2)
        scaled = weights * length / 2
        block = slopes.T * (scaled * (2 / length) ** 2) @ slopes
        block -= values.T * (scaled * potential) @ values
        stiffness[np.ix_(index, index)] += block
        mass[np.ix_(index, index)] += values.T * scaled @ values
        constraints[j, index] += (scaled * cosine) @ values
        keep[first] = segment.kind.end == "pinned"
    keep[-1] = problem.spring is not None
    if problem.spring is not None:
        stiffness[-1, -1] += float(problem.spring)
    inner = np.ix_(keep, keep)
    return _lowest(stiffness[inner], mass[inner], constraints[:, keep], count)


def _polish(problem, start):
    """Refine an eigenvalue by the secant method."""
    scale = max(1.0, abs(start))
    old = mpf(start)
    new = old + mpf(1e-10 * scale)
    f_old, f_new = problem.determinant(old), problem.determinant(new)
    for _ in range(20):
        if f_new == f_old:
            break
        change = f_new * (new - old) / (f_new - f_old)
        old, f_old = new, f_new
        new = new - change
        if abs(change) < mpf(10) ** -25 * scale:  # the next error is beyond 1e-35
            break
        f_new = problem.determinant(new)
    else:
        raise ArithmeticError("secant method did not converge")
    if abs(new - start) > 1e-7 * scale:
        raise ArithmeticError(f"secant method left its start {start!r}")
    return new


def eigenvalues(state, ends, kappa, p, segments, split=True):
    """Four lowest eigenvalues of the second variation with moving contacts.

    Parameters
    ----------
    state, ends : str
        The state's name and its end conditions.
    kappa, p : mpf
        Curvature and thrust.
    segments : list of Segment
        Free segments.
    split : bool
        Whether to separate a symmetric state's even and odd functions.

    Returns
    -------
    list of mpf
        Eigenvalues in ascending order.
    """
    starts, done = [], {}
    for number, problem in enumerate(problems(state, ends, kappa, segments, split)):
        found = galerkin(problem, kappa, p)
        zero = int(np.argmin(np.abs(found))) if problem.exact_zero else -1
        if zero >= 0 and abs(found[zero]) > 1e-6:
            raise ArithmeticError("the exact zero of a line state is missing")
        starts += [(x, number, k, problem, k == zero) for k, x in enumerate(found)]
    starts.sort(key=lambda item: item[:3])
    result = []
    for start, _, k, problem, is_zero in starts[:EIGENVALUES]:
        key = (tuple(id(s) for s in problem.segments), problem.spring, k)
        if key not in done:  # equal segments of a line state: each value twice
            done[key] = mpf(0) if is_zero else _polish(problem, start)
        result.append(done[key])
    result.sort()
    unique = sorted(done.values())
    if any(b - a < 1e-15 * max(1, abs(b)) for a, b in pairwise(unique)):
        raise ArithmeticError("two starts led to one eigenvalue")
    return result


# ------------------------------------------------------------------------------------- records
def _text(x):
    """Write a number with 22 significant digits."""
    return "0" if x == 0 else mp.nstr(x, DIGITS, strip_zeros=False)


def reference(state, ends, P, H):
    """Compute a reference record.

    Parameters
    ----------
    state, ends : str
        The state's name and its end conditions, see `STATES`.
    P, H : float
        Dimensionless load and wall distance, taken as exact doubles.

    Returns
    -------
    dict
        The record as stored, numbers as strings except for P and H.
    """
    with mp.workdps(WORKING_DIGITS):
        kappa, p, segments = equilibrium(state, ends, P, H)
        _, regime = layout(state, ends)
        flat = 1 - sum(s.length for s in segments) if regime == "line" else mpf(0)
        shortening = sum(s.length - s.advance for s in segments)
        bending = sum(p * s.advance + s.lam * s.rise + (kappa**2 / 2 - p) * s.length for s in segments)
        if flat < 0:
            raise ArithmeticError("negative flat length")
        scale = 4 * mp.pi**2
        free = regime == "free"
        reaction = mpf(0) if free else sum(s.lam for s in segments)
        slope = max(steepest(s.kind, kappa, s.lam, p) for s in segments)
        found = eigenvalues(state, ends, kappa, p, segments)
        return {
            "state": state,
            "ends": ends,
            "P": P,
            "H": H,
            "kappa": _text(kappa),
            "lam": [_text(s.lam) for s in segments],
            "lengths": [_text(s.length) for s in segments],
            "energy": _text((bending - p * shortening) / scale),
            "bending_energy": _text(bending / scale),
            "shortening": _text(shortening),
            "reaction": _text(reaction / scale),
            "contact_position": None if free else _text(segments[0].length),
            "max_slope": _text(slope),
            "eigenvalues": [_text(x) for x in found],
        }


def draw(number, seed=SEED):
    """Draw a random point, P uniform where the state exists, H log-uniform.

    Parameters
    ----------
    number : int
        Number of the point; points are the same whatever their count.
    seed : int
        Seed of the whole set.

    Returns
    -------
    tuple
        State, ends, P, H.
    """
    pairs = [(state, ends) for ends in ENDS for state in STATES[ends]]
    state, ends = pairs[number % len(pairs)]
    rng = random.Random(f"{seed}/{state}/{ends}/{number // len(pairs)}")
    free = layout(state, ends)[1] == "free"
    while True:
        H = math.exp(rng.uniform(*map(math.log, H_RANGE)))
        for _ in range(10_000 if free else 40):
            P = rng.uniform(*P_RANGE)
            if locate(state, ends, P, H) is not None:
                return state, ends, P, H


def generate(count, output, seed=SEED):
    """Write a file of reference records, one per line.

    Parameters
    ----------
    count : int
        Number of records.
    output : pathlib.Path
        File to write.
    seed : int
        Seed of the random points.
    """
    begin = time.monotonic()
    lines = []
    for number in range(count):
        point = draw(number, seed)
        lines.append(json.dumps(reference(*point), separators=(",", ":")))
        if (number + 1) % 10 == 0 or number + 1 == count:
            spent = time.monotonic() - begin
            print(f"{number + 1}/{count} records, {spent:.0f} s", file=sys.stderr, flush=True)
    head = f'{{"seed":{seed},"digits":{DIGITS},"states":[\n'
    output.write_text(head + ",\n".join(lines) + "\n]}\n", encoding="utf-8")


# -------------------------------------------------------------------------------------- checks
def integrate_shape(theta, curvature, lam, p, length, steps, order=56):
    """Integrate the elastica's equation by Taylor series in floating point.

    Parameters
    ----------
    theta, curvature : mpf
        Starting values.
    lam, p : mpf
        Forces.
    length : mpf
        Arc length.
    steps, order : int
        Number of steps and of Taylor coefficients.

    Returns
    -------
    tuple of mpf
        Angle and curvature at the end, rise, advance.
    """
    h = length / steps
    powers = [h**k for k in range(order + 2)]
    rise = advance = mpf(0)
    for _ in range(steps):
        t, s, c = [theta, curvature], [mp.sin(theta)], [mp.cos(theta)]
        dt = [curvature]
        for k in range(order):
            s.append(mp.fdot(dt, c[::-1]) / (k + 1))
            c.append(-mp.fdot(dt, s[k::-1]) / (k + 1))
            t.append((lam * c[k] - p * s[k]) / ((k + 1) * (k + 2)))
            dt.append((k + 2) * t[-1])
        rise += sum(s[k] * powers[k + 1] / (k + 1) for k in range(order + 1))
        advance += sum(c[k] * powers[k + 1] / (k + 1) for k in range(order + 1))
        theta = mp.fdot(t, powers)
        curvature = mp.fdot(dt, powers)
    return theta, curvature, rise, advance


def finite_elements(problem, kappa, p, size, count=EIGENVALUES + 1):
    """Lowest eigenvalues of a problem from linear elements on an integrated shape."""
    p = float(p)
    number = len(problem.segments)
    total = number * size + 1
    stiffness, mass = np.zeros((2, total, total))
    constraints = np.zeros((number, total))
    keep = np.ones(total, bool)
    points = np.array([-1, 1]) / (2 * math.sqrt(3)) + 0.5
    for j, segment in enumerate(problem.segments):
        lam, length = float(segment.lam), float(segment.length)
        start, _ = end_values(segment.kind, kappa, segment.lam, mpf(p))
        h = length / size
        nodes = ((np.arange(size)[:, None] + points) * h).ravel()
        theta = integrate.solve_ivp(
            lambda _, y, lam=lam: (y[1], lam * math.cos(y[0]) - p * math.sin(y[0])),
            (0, length),
            [float(x) for x in start],
            method="DOP853",
            t_eval=nodes,
            rtol=1e-11,
            atol=1e-12,
        ).y[0]
        potential = (p * np.cos(theta) + lam * np.sin(theta)).reshape(size, 2)
        cosine = np.cos(theta).reshape(size, 2)
        index = np.append(j * size + np.arange(size), total - 1)
        hats = np.array([1 - points, points])
        for a in range(2):
            rows = index[a : size + a]
            constraints[j, rows] += h / 2 * cosine @ hats[a]
            for b in range(2):
                product = hats[a] * hats[b] * h / 2
                columns = index[b : size + b]
                stiffness[rows, columns] += (1 if a == b else -1) / h - potential @ product
                mass[rows, columns] += product.sum()
        keep[j * size] = segment.kind.end == "pinned"
    keep[-1] = problem.spring is not None
    if problem.spring is not None:
        stiffness[-1, -1] += float(problem.spring)
    inner = np.ix_(keep, keep)
    return _lowest(stiffness[inner], mass[inner], constraints[:, keep], count)


def expected_index(state, ends, kappa, p, segments):
    """Number of negative eigenvalues from the closed form, for slopes below 90 degrees."""
    _, regime = layout(state, ends)
    if regime == "free":
        return int(state[1]) - 1
    count = sum(s.kind.letter == "A" for s in segments)
    if regime == "line":
        return count

    def length(kind, lam, change):
        x = kappa + change
        rise = segments[0].rise
        (lam,) = _newton(lambda y: [measure(kind, x, y, p)[1] - rise], [lam], mpf(10) ** -40)
        return measure(kind, x, lam, p)[0]

    step = kappa * mpf(10) ** -12
    growth = sum(length(s.kind, s.lam, step) - length(s.kind, s.lam, -step) for s in segments)
    return count - int(growth > 0)


KNOWN = [  # state, P, H, record's entry, value, tolerance; clamped-clamped
    ("U", 2.5, 0.05, "kappa", 0.585906, 5e-7),
    ("U", 2.5, 0.05, "reaction", 0.383812, 5e-7),
    ("U", 2.5, 0.05, "shortening", 0.00662053, 5e-9),
    ("U", 2.5, 0.05, "eigenvalues", 24.9359203, 5e-8),
    ("U", 1.5, 0.1, "eigenvalues", 37.0744467, 5e-8),
    ("U", 2.5, 0.1, "eigenvalues", 24.8282985, 5e-8),
    ("U", 3.5, 0.1, "eigenvalues", 8.5092666, 5e-8),
    ("U", 3.9, 0.1, "eigenvalues", 0.7652699, 5e-8),
    ("Ua", 3.0, 0.1, "kappa", 1.91976, 5e-6),
    ("Ua", 3.0, 0.1, "lengths", 0.425, 5e-4),
    ("Ua", 3.0, 0.1, "eigenvalues", -15.2061, 5e-5),
    ("B2", 2.06, 0.1, "kappa", 2.4489, 5e-5),
    ("B2", 2.06, 0.1, "lam", -4 * math.pi**2 * 2.06 * math.tan(0.06128), 5e-4),
]


def check(rounds=2, seed=SEED):
    """Test the numbers by other means, on points of their own, and print the largest errors.

    Parameters
    ----------
    rounds : int
        Points per state and end condition.
    seed : int
        Seed; that of the points is the next one.
    """
    for state, P, H, entry, value, tolerance in KNOWN:
        found = reference(state, "clamped-clamped", P, H)[entry]
        found = float(found[0] if isinstance(found, list) else found)
        print(f"{state} P={P} H={H} {entry}: {found:.10g}, known {value}")
        assert abs(found - value) <= tolerance

    worst = dict.fromkeys(
        ("shape", "precision", "finite elements", "dU/dP", "dU/dH", "root", "count"), mpf(0)
    )

    def note(name, error):
        worst[name] = max(worst[name], mpf(error))

    number = rounds * sum(map(len, STATES.values()))
    for k in range(number):
        state, ends, P, H = draw(k, seed + 1)
        with mp.workdps(WORKING_DIGITS):
            kappa, p, segments = equilibrium(state, ends, P, H)
            # the shape as an initial value problem, with other steps and in floating point
            for s in segments:
                start, end = end_values(s.kind, kappa, s.lam, p)
                steps = math.ceil(6 * s.length * mp.sqrt(mp.hypot(p, s.lam)))
                found = integrate_shape(*start, s.lam, p, s.length, steps)
                wanted = (*end, s.rise, s.advance)
                note("shape", max(abs(x - y) for x, y in zip(found, wanted, strict=True)))
            values = eigenvalues(state, ends, kappa, p, segments)
            # number and order of the eigenvalues: finite elements on the undivided problem
            rough = {size: [] for size in (160, 320)}
            for problem in problems(state, ends, kappa, segments, split=False):
                for size, found in rough.items():
                    found.extend(finite_elements(problem, kappa, p, size))
            coarse, fine = (np.sort(found)[:EIGENVALUES] for found in rough.values())
            extrapolated = fine + (fine - coarse) / 3
            for x, y in zip(values, extrapolated, strict=True):
                note("finite elements", abs(x - y) / (10 + abs(x)))
            negative = sum(x < 0 for x in values)
            note("count", abs(negative - expected_index(state, ends, kappa, p, segments)))
        # the same eigenvalues with more digits, more terms, other steps
        with mp.workdps(WORKING_DIGITS + 20):
            kappa, p, segments = equilibrium(state, ends, P, H)
            for s in segments:
                s.series = Series(s.kind, kappa, s.lam, p, s.length, BITS + 56, ORDER + 18)
            again = eigenvalues(state, ends, kappa, p, segments, split=False)
            for x, y in zip(values, again, strict=True):
                note("precision", abs(x - y) / (1 + abs(x)))
        # the same root from a ten times denser scan
        note("root", abs(float(kappa) - locate(state, ends, P, H, density=10)[0]))
        # derivatives of the energy by central differences
        record = reference(state, ends, P, H)
        step = 2.0**-24
        slopes = []
        for dP, dH in ((step, 0.0), (0.0, step)):
            up, down = (
                mpf(reference(state, ends, P + sign * dP, H + sign * dH)["energy"]) for sign in (1, -1)
            )
            slopes.append((up - down) / (mpf(P + dP) - mpf(P - dP) + mpf(H + dH) - mpf(H - dH)))
        note("dU/dP", abs(slopes[0] + mpf(record["shortening"])))
        if not state.startswith("B"):
            note("dU/dH", abs(slopes[1] + mpf(record["reaction"])))
        print(f"{k + 1}/{number} {state} {ends} P={P:.6f} H={H:.6f}", flush=True)
    limits = {
        "shape": 1e-45,
        "precision": 1e-30,
        "finite elements": 1e-4,
        "dU/dP": 1e-9,
        "dU/dH": 1e-9,
        "root": 1e-9,
        "count": 0,
    }
    for name, error in worst.items():
        print(f"{name}: largest error {mp.nstr(error, 3)}, allowed {limits[name]}")
        assert error <= limits[name], name


def main():
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=COUNT, help="number of records")
    parser.add_argument("--seed", type=int, default=SEED, help="seed of the random points")
    parser.add_argument(
        "--output", type=Path, default=Path(__file__).with_name("states.json"), help="file to write"
    )
    parser.add_argument("--check", action="store_true", help="test by other means, write nothing")
    arguments = parser.parse_args()
    if arguments.check:
        check(seed=arguments.seed)
    else:
        generate(arguments.count, arguments.output, arguments.seed)


if __name__ == "__main__":
    main()
