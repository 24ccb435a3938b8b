"""Brute-force search for all equilibria of an elastica between two walls (independent reference).

Nothing here uses the package: the program knows the pendulum's elliptic integrals, scans densely, brackets
every sign change, looks for pairs of roots near every extremum that comes close to zero, and polishes what it
finds with 30 digits.  Units inside: EI = L = 1, p = 4 pi^2 P, c = 4 pi^2 k.

A segment is described by its orbit, the pair (kappa, lam):
theta'^2 = kappa^2 - 2p(1 - cos theta) + 2 lam sin theta.
At fixed kappa the largest angle beta of the orbit and lam determine each other,
lam = p tan(beta/2) - kappa^2 / (2 sin beta), so a scan over beta in (0, 90 degrees] misses no lam.

Usage:  python search.py --seed 1 --count 40 --out points.json
"""

import argparse
import itertools
import json
import math
import time
from collections import Counter
from types import SimpleNamespace

import mpmath
import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, minimize_scalar
from scipy.special import ellipeinc, ellipkinc

QUARTER = np.pi / 2
DIGITS = 30
P_MAX = 12.0

DOUBLE = SimpleNamespace(
    pi=np.pi,
    sqrt=np.sqrt,
    sin=np.sin,
    cos=np.cos,
    atan2=np.arctan2,
    where=np.where,
    first=ellipkinc,
    second=ellipeinc,
)
MULTI = SimpleNamespace(
    pi=mpmath.pi,
    sqrt=mpmath.sqrt,
    sin=mpmath.sin,
    cos=mpmath.cos,
    atan2=mpmath.atan2,
    where=lambda condition, a, b: a if condition else b,
    first=mpmath.ellipf,
    second=mpmath.ellipe,
)


# ----------------------------------------------------------------------------------------------------------
# One orbit
# ----------------------------------------------------------------------------------------------------------


def lam_of_beta(p, kappa, beta):
    """Return the lam whose orbit has the largest angle beta."""
    return p * np.tan(beta / 2) - kappa**2 / (2 * np.sin(beta))


def turning_angle(p, kappa, lam):
    """Return the largest angle of the orbit (of its mirror image, with -lam: minus the smallest angle)."""
    a = 4 * p - kappa**2
    root = np.sqrt(4 * lam**2 + a * kappa**2)
    with np.errstate(divide="ignore", invalid="ignore"):
        tangent = np.where(np.asarray(lam) > 0, (2 * lam + root) / a, kappa**2 / (root - 2 * lam))
    return 2 * np.arctan(np.where(np.asarray(kappa) + np.abs(lam) > 0, tangent, 0.0))


def start_angle(p, kappa, lam, c):
    """Return the positive angle of the orbit at which theta' = +c theta (vectorised, safeguarded Newton)."""
    beta = turning_angle(p, kappa, lam)
    if c == 0:
        return beta
    stiff = p + c**2
    low, high = np.zeros_like(beta), beta
    theta = np.clip((lam + np.sqrt(lam**2 + stiff * kappa**2)) / stiff, 0, beta)
    for _ in range(100):
        value = kappa**2 - 4 * p * np.sin(theta / 2) ** 2 + 2 * lam * np.sin(theta) - (c * theta) ** 2
        slope = -2 * p * np.sin(theta) + 2 * lam * np.cos(theta) - 2 * c**2 * theta
        low, high = np.where(value > 0, theta, low), np.where(value > 0, high, theta)
        with np.errstate(divide="ignore", invalid="ignore"):
            step = theta - value / slope
        small = np.abs(step - theta) <= 2e-15 * theta
        new = np.where(small | (step > low) & (step < high), step, (low + high) / 2)
        theta = np.where(theta > 0, new, theta)
        if np.all(small | (theta == 0)):
            break
    return theta


def start_angle_multi(p, kappa, lam, c):
    """Do the same with many digits (scalars)."""
    theta = mpmath.mpf(float(start_angle(float(p), float(kappa), float(lam), float(c))))
    if theta == 0:
        return theta
    for _ in range(60):
        sine, cosine = mpmath.sin(theta), mpmath.cos(theta)
        value = kappa**2 - 2 * p * (1 - cosine) + 2 * lam * sine - (c * theta) ** 2
        slope = -2 * p * sine + 2 * lam * cosine - 2 * c**2 * theta
        step = value / slope
        theta -= step
        if abs(step) < mpmath.mpf(10) ** (3 - DIGITS):
            break
    return theta


def start_state(p, kappa, lam, c, kind, lib=DOUBLE):
    """Return angle and curvature at the start of a rising segment that leaves an end of spring c."""
    sign = 1 if kind == "S" else -1
    if c == math.inf:
        return 0 * kappa, sign * kappa
    find = start_angle if lib is DOUBLE else start_angle_multi
    theta = sign * find(p, kappa, sign * lam, c)
    return theta, c * theta


def piece(p, kappa, lam, c, kind, lib=DOUBLE):
    """Follow the pendulum from an end to the first contact at which theta' = -kappa.

    Parameters
    ----------
    p, kappa, lam : float or array
        Thrust, curvature at theta = 0 and vertical force in the rising convention.
    c : float
        Spring at the start, inf for a clamp or a contact.
    kind : str
        'S' starts at theta > 0 or with +kappa, 'A' at theta < 0 or with -kappa.

    Returns
    -------
    tuple
        Length, rise, advance; the same three for one full period; starting angle.
    """
    force = lib.sqrt(p * p + lam * lam)
    r = lib.sqrt(force)
    alpha = lib.atan2(lam, p)
    half = lib.sin(alpha / 2)
    m = kappa * kappa / (4 * force) + half * half
    theta, bend = start_state(p, kappa, lam, c, kind, lib)
    phase0 = lib.atan2(2 * r * half, kappa)
    phase1 = lib.atan2(2 * r * lib.sin((theta - alpha) / 2), bend)
    if kind == "A":
        phase1 = lib.where(phase1 > 0, phase1 - 2 * lib.pi, phase1)
    phase2 = lib.pi + phase0
    length = (lib.first(phase2, m) - lib.first(phase1, m)) / r
    bulk = 2 * (lib.second(phase2, m) - lib.second(phase1, m)) / r - length
    jump = (bend + kappa) / force
    sine, cosine = lib.sin(alpha), lib.cos(alpha)
    period = 4 * lib.first(lib.pi / 2, m) / r
    period_bulk = 8 * lib.second(lib.pi / 2, m) / r - period
    return (
        length,
        cosine * jump + sine * bulk,
        cosine * bulk - sine * jump,
        period,
        sine * period_bulk,
        cosine * period_bulk,
        theta,
    )


# ----------------------------------------------------------------------------------------------------------
# Kinds of segments.  A key is (role, kind, j): role 'A', 'B' (ends), 'W' (wall to wall) or 'F' (end to end,
# free); kind 'S', 'A' or '0'; j further full periods.
# ----------------------------------------------------------------------------------------------------------


class Setting:
    """The constants of one problem: ends, wall distance and what follows from them."""

    def __init__(self, ends, height):
        self.ends = tuple(float(k) for k in ends)
        self.height = float(height)
        self.spring = {"A": 4 * np.pi**2 * self.ends[0], "B": 4 * np.pi**2 * self.ends[1], "W": math.inf}
        self.alike = self.ends[0] == self.ends[1]

    def rise(self, key):
        """Return the height that a segment has to climb."""
        return {"A": self.height, "B": self.height, "W": 2 * self.height, "F": 0.0}[key[0]]

    def segment(self, key, p, kappa, lam, lib=DOUBLE):
        """Return length, rise, advance of a segment."""
        role, kind, j = key
        if role == "F":
            first = piece(p, kappa, lam, self.spring["A"], "S", lib)
            last = piece(p, kappa, -lam, self.spring["B"], kind, lib)
            return (
                first[0] + last[0] + j * first[3],
                first[1] - last[1] + j * first[4],
                first[2] + last[2] + j * first[5],
            )
        out = piece(p, kappa, lam, self.spring[role], "A" if kind == "0" else kind, lib)
        return tuple(out[i] + j * out[i + 3] for i in range(3))


def both_signs(key):
    """Tell whether the segment visits negative angles as well as positive ones."""
    return not (key[0] != "F" and key[1] == "S" and key[2] == 0)


def beta_range(setting, key, p, kappa):
    """Return the interval of beta in which all angles of the segment stay below 90 degrees."""
    low = 2 * np.arctan(kappa**2 / (4 * p - kappa**2)) if both_signs(key) else 0 * kappa
    if key[0] != "F":
        low = np.maximum(low, 0.99 * setting.height)
    return np.minimum(low, QUARTER), QUARTER


def bracketed_roots(function, low, high, f_low, f_high):
    """Solve many scalar equations at once by the Illinois method mixed with bisection."""
    low, high, f_low, f_high = (np.array(v, float) for v in (low, high, f_low, f_high))
    for count in range(120):
        if count % 4 == 3:
            middle = (low + high) / 2
        else:
            with np.errstate(divide="ignore", invalid="ignore"):
                middle = (low * f_high - high * f_low) / (f_high - f_low)
            middle = np.where((middle > low) & (middle < high), middle, (low + high) / 2)
        value = function(middle)
        left = np.sign(value) == np.sign(f_low)
        f_high = np.where(left, f_high / 2 if count % 4 != 3 else f_high, value)
        f_low = np.where(left, value, f_low / 2 if count % 4 != 3 else f_low)
        low, high = np.where(left, middle, low), np.where(left, high, middle)
        if np.all((np.abs(value) < 1e-14) | (high - low < 4e-16 * high)):
            break
    return middle


def tabulate(setting, keys, p, kappa, nodes=160):
    """For all given (p, kappa) find the lam of each key by a dense scan.

    Parameters
    ----------
    keys : list of tuple
        Kinds of segments; all with the same role and kind are scanned together.
    p, kappa : array
        Nodes, same shape (1-D).
    nodes : int
        Number of beta nodes of the scan.

    Returns
    -------
    dict
        key -> array (3, number of nodes) with lam, length, shortening; nan where no lam exists.
    """
    table = {}
    for key in keys:
        out = np.full((3, len(p)), np.nan)
        if key[1] == "0":
            length, _, advance = setting.segment(key, p, kappa, 0 * p)
            out[:] = 0 * p, length, length - advance
            out[:, kappa**2 > 2 * p] = np.nan
            if len(p) and kappa[0] == 0:
                out[:, kappa == 0] = np.nan
            table[key] = out
    families = {}
    for key in keys:
        if key[1] != "0":
            families.setdefault((key[0], key[1], both_signs(key)), []).append(key)
    for family in families.values():
        role, kind, _ = family[0]
        base = (role, kind, 0) if both_signs(family[0]) else family[0]
        low, high = beta_range(setting, family[0], p, kappa)
        usable = np.flatnonzero((kappa > 0) & (low < high)) if role == "F" else np.flatnonzero(low < high)
        for key in family:
            table[key] = np.full((3, len(p)), np.nan)
        for chunk in np.array_split(usable, max(1, len(usable) * nodes // 400000)):
            pc, kc, lc = p[chunk, None], kappa[chunk, None], np.log(low[chunk, None])
            beta = np.exp(lc + (np.log(high) - lc) * np.linspace(0, 1, nodes))
            beta[:, -1] = high
            lam = lam_of_beta(pc, kc, beta)
            rise0 = setting.segment(base, pc, kc, lam)[1]
            rise1 = setting.segment((role, kind, 1), pc, kc, lam)[1] if both_signs(family[0]) else rise0
            for key in family:
                values = rise0 + (key[2] - base[2]) * (rise1 - rise0) - setting.rise(key)
                change = (values[:, :-1] > 0) != (values[:, 1:] > 0)
                if change.sum(axis=1).max(initial=0) > 1:
                    raise RuntimeError(f"lam is not unique for {key}")
                row, col = np.nonzero(change)
                if not len(row):
                    continue
                at = chunk[row]
                pk, kk = p[at], kappa[at]

                def climb(b, key=key, pk=pk, kk=kk):
                    return setting.segment(key, pk, kk, lam_of_beta(pk, kk, b))[1] - setting.rise(key)

                root = bracketed_roots(
                    climb, beta[row, col], beta[row, col + 1], values[row, col], values[row, col + 1]
                )
                found = lam_of_beta(pk, kk, root)
                length, _, advance = setting.segment(key, pk, kk, found)
                table[key][:, at] = found, length, length - advance
    return table


def solve_lam(setting, key, p, kappa):
    """Return the lam of one key at one (p, kappa), nan if there is none."""
    if key[1] == "0":
        return 0.0
    low, high = beta_range(setting, key, p, kappa)

    def climb(beta):
        return float(setting.segment(key, p, kappa, lam_of_beta(p, kappa, beta))[1] - setting.rise(key))

    if low >= high or (climb(low) > 0) == (climb(high) > 0):
        return math.nan
    return float(lam_of_beta(p, kappa, brentq(climb, low, high, xtol=1e-15, rtol=1e-14)))


# ----------------------------------------------------------------------------------------------------------
# Combinations of segments and the words they spell
# ----------------------------------------------------------------------------------------------------------


def available_keys(setting, p, kappa, max_contacts):
    """List the kinds of segments that may be short enough, for thrusts up to max(p)."""
    shortest = 2 * np.pi / (2 * np.max(p) ** 2) ** 0.25
    most = int(1 / shortest)
    roles = ["A"] if setting.alike else ["A", "B"]
    keys = [(role, kind, j) for role in roles for kind in "SA" for j in range(most + 1)]
    if max_contacts > 1:
        keys += [("W", "0", 0)] + [("W", "S", j) for j in range(most + 1)]
    return keys, [("F", kind, j) for j in range(most + 1) for kind in "SA"]


def combinations(setting, shortest, max_contacts):
    """Yield all multisets of segments with contacts as (key of end A, key of end B, tuple of inner keys)."""
    short = {key: value for key, value in shortest.items() if value <= 1}
    first = [key for key in short if key[0] == "A"]
    last = [key for key in short if key[0] == "B"]
    if setting.alike:
        pairs = itertools.combinations_with_replacement(first, 2)
    else:
        pairs = itertools.product(first, last)
    inner = [key for key in short if key[0] == "W"]
    for one, two in list(pairs):
        for count in range(max_contacts):
            for middle in itertools.combinations_with_replacement(inner, count):
                if short[one] + short[two] + sum(short[key] for key in middle) <= 1:
                    yield one, two, middle


def spell(first, last, middle, alike):
    """Return the distinct words (word, kinds, periods, chain of keys) that a multiset can spell."""
    words = {}
    for order in set(itertools.permutations(middle)):
        letters = ["U"]
        for key in order:
            same = key[1] == "0"
            letters.append(letters[-1] if same else "DU"[letters[-1] == "D"])
        word = "".join(letters)
        chain = (first, *order, last)
        images = [(word, first[1] + last[1], tuple(key[2] for key in chain), chain)]
        if alike:
            back = word[::-1]
            if back[0] == "D":
                back = back.translate(str.maketrans("UD", "DU"))
            images.append((back, last[1] + first[1], tuple(key[2] for key in chain[::-1]), chain[::-1]))
        best = max(images)
        words[best[:3]] = best
    return list(words.values())


def reactions_of(chain, lams):
    """Return the reactions at the contacts of a chain of segments."""
    return [lams[a] + lams[b] for a, b in itertools.pairwise(chain)]


# ----------------------------------------------------------------------------------------------------------
# Roots in one variable
# ----------------------------------------------------------------------------------------------------------


def roots_of(function, x, y, keep=None):
    """Return all roots of a function tabulated as y(x), pairs of roots between nodes included.

    Parameters
    ----------
    function : callable
        The function (may return nan).
    x, y : array
        Table, nan where undefined.
    keep : array of bool, optional
        Intervals (len(x) - 1) that are worth looking at.
    """
    keep = np.ones(len(x) - 1, bool) if keep is None else keep
    found = []
    for i in np.flatnonzero((y[:-1] > 0) != (y[1:] > 0)):
        if keep[i] and np.isfinite(y[i]) and np.isfinite(y[i + 1]):
            found.append(solve_between(function, x[i], x[i + 1]))
    for i in range(1, len(x) - 1):
        a, b, c = y[i - 1 : i + 2]
        if not (np.isfinite(a) and np.isfinite(b) and np.isfinite(c)) or not (keep[i - 1] or keep[i]):
            continue
        side = 1 if b > 0 else -1
        if side * a < side * b or side * c < side * b or side * a < 0 or side * c < 0:
            continue
        if abs(b) > 2 * max(abs(a - b), abs(c - b)) + 1e-9:
            continue
        best = minimize_scalar(
            lambda t, s=side: s * function(t),
            bounds=(x[i - 1], x[i + 1]),
            method="bounded",
            options={"xatol": 1e-9 * (x[i + 1] - x[i - 1])},
        )
        if best.fun < 0:
            found += [solve_between(function, x[i - 1], best.x), solve_between(function, best.x, x[i + 1])]
    return [root for root in found if root is not None]


def solve_between(function, low, high):
    """Return the root in a bracket, None if the function is undefined inside."""
    f_low, f_high = function(low), function(high)
    if not (np.isfinite(f_low) and np.isfinite(f_high)) or (f_low > 0) == (f_high > 0):
        return None
    try:
        return brentq(function, low, high, xtol=1e-14, rtol=1e-13)
    except ValueError:
        return None


# ----------------------------------------------------------------------------------------------------------
# Polishing and recording
# ----------------------------------------------------------------------------------------------------------


def polish(setting, keys, kappa, lams, p, shortening, line):
    """Solve for kappa, all lam (and p if the shortening is given) with many digits.

    The Jacobian is a finite difference in double precision, the residual has many digits.

    Returns
    -------
    tuple or None
        kappa, dict of lam, p as mpf, and the size of the last step; None without convergence.
    """
    weights = Counter(keys)
    free = [key for key in weights if key[1] != "0"]

    def residual(x, lib):
        x = list(x)
        k = 0 * x[0] if line else x.pop(0)
        values = dict(zip(free, x, strict=False))
        thrust = x[-1] if shortening is not None else (p if lib is DOUBLE else mpmath.mpf(p))
        parts = {key: setting.segment(key, thrust, k, values.get(key, 0 * thrust), lib) for key in weights}
        out = [parts[key][1] - setting.rise(key) for key in free]
        if not line:
            out.append(sum(count * parts[key][0] for key, count in weights.items()) - 1)
        if shortening is not None:
            out.append(
                sum(count * (parts[key][0] - parts[key][2]) for key, count in weights.items()) - shortening
            )
        return out

    x = ([] if line else [kappa]) + [lams[key] for key in free] + ([p] if shortening is not None else [])
    scale = [math.sqrt(p)] * (0 if line else 1) + [p] * (len(free) + (shortening is not None))
    with mpmath.workdps(DIGITS):
        x = [mpmath.mpf(float(v)) for v in x]
        jacobian, age, last = None, 0, math.inf
        for _ in range(40):
            value = residual(x, MULTI)
            size = max(abs(v) for v in value)
            if size < mpmath.mpf(10) ** (5 - DIGITS):
                break
            if jacobian is None or age > 3:
                point = np.array([float(v) for v in x])
                jacobian = np.empty((len(x), len(x)))
                for i, unit in enumerate(scale):
                    step = 1e-6 * unit
                    if not line and i == 0:
                        step = min(step, 1e-3 * point[0])
                    up, down = point.copy(), point.copy()
                    up[i], down[i] = up[i] + step, down[i] - step
                    jacobian[:, i] = [
                        (float(a) - float(b)) / (2 * step)
                        for a, b in zip(residual(up, DOUBLE), residual(down, DOUBLE), strict=True)
                    ]
                age = 0
            age += 1
            exponent = int(mpmath.floor(mpmath.log10(size)))
            factor = mpmath.mpf(10) ** exponent
            try:
                move = np.linalg.solve(jacobian, [float(v / factor) for v in value])
            except np.linalg.LinAlgError:
                return None
            x = [v - mpmath.mpf(float(s)) * factor for v, s in zip(x, move, strict=True)]
            if (not line and x[0] <= 0) or (shortening is not None and x[-1] <= 0):
                return None
            last = float(size)
        else:
            return None
        x = list(x)
        new_kappa = mpmath.mpf(0) if line else x.pop(0)
        new_lams = {key: mpmath.mpf(0) for key in weights}
        new_lams.update(zip(free, x, strict=False))
        return new_kappa, new_lams, (x[-1] if shortening is not None else mpmath.mpf(p)), last


def crossings(setting, key, p, kappa, lam):
    """Return the heights of the horizontal points inside a rising segment that ends at its wall, y = H."""
    role, kind, j = key
    lobe = piece(p, kappa, lam, math.inf, "S")[1]
    whole = piece(p, kappa, lam, math.inf, "A")[1]
    if role == "F":
        top = piece(p, kappa, lam, setting.spring["A"], "S")[1]
        heights = [top]
        for i in range(j):
            heights += [top + (i + 1) * whole - lobe, top + (i + 1) * whole]
        if kind == "A":
            heights.append(
                piece(p, kappa, -lam, setting.spring["B"], "A")[1] - piece(p, kappa, -lam, math.inf, "S")[1]
            )
        return heights
    heights = []
    for i in range(j):
        heights += [setting.height - lobe - i * whole, setting.height - (i + 1) * whole]
    if kind in "A0":
        heights.append(setting.height - lobe - j * whole)
    return heights


def make_records(setting, keys, spelled, kappa, lams, p, line, flat=0.0):
    """Return the admissible records that a polished combination stands for."""
    weights = Counter(keys)
    kappa, p = float(kappa), float(p)
    lams = {key: float(value) for key, value in lams.items()}
    parts = {key: setting.segment(key, p, kappa, lams[key]) for key in weights}
    angles = {}
    heights = []
    for key in weights:
        angles[key] = float(turning_angle(p, kappa, lams[key]))
        if both_signs(key) and not line:
            angles[key] = max(angles[key], float(turning_angle(p, kappa, -lams[key])))
        if not line:
            heights += crossings(setting, key, p, kappa, lams[key])
    steepest = max(angles.values())
    top = max((abs(float(h)) for h in heights), default=None)
    if steepest >= QUARTER or (top is not None and top > setting.height * (1 + 1e-11)):
        return []
    shortening = sum(count * float(parts[key][0] - parts[key][2]) for key, count in weights.items())
    energy = kappa**2 / 2 - 2 * p * shortening
    energy += sum(count * lams[key] * setting.rise(key) for key, count in weights.items())
    free = keys[0][0] == "F"
    roles = (
        [("A", "S", lams[keys[0]]), ("B", keys[0][1], -lams[keys[0]])]
        if free
        else [(keys[0][0], keys[0][1], lams[keys[0]]), (keys[-1][0], keys[-1][1], lams[keys[-1]])]
    )
    for role, kind, lam in roles:
        c = setting.spring[role]
        if 0 < c < math.inf:
            energy += c * float(start_state(p, kappa, lam, c, kind)[0]) ** 2 / 2
    common = {"P": p / (4 * np.pi**2), "kappa": kappa}
    common_end = {
        "V": float(energy),
        "shortening": shortening,
        "max_theta": steepest,
        "clearance": None if top is None else setting.height - top,
    }
    if free:
        key = keys[0]
        return [
            {
                "word": "",
                "kinds": "S" + key[1],
                "periods": [key[2]],
                "regime": "free",
                "mode": 1 + 2 * key[2] + (key[1] == "A"),
                **common,
                "lam": [lams[key]],
                "lengths": [1.0],
                "reactions": [],
                **common_end,
            }
        ]
    records = []
    for word, kinds, periods, chain in spelled:
        reactions = reactions_of(chain, lams)
        if min(reactions) < -1e-11 * p:
            continue
        record = {
            "word": word,
            "kinds": kinds,
            "periods": list(periods),
            "regime": "line" if line else "point",
            **common,
            "lam": [lams[key] for key in chain],
            "lengths": [float(parts[key][0]) for key in chain],
            "reactions": reactions,
            **common_end,
        }
        if line:
            record["flat"] = flat
        records.append(record)
    return records


def straight_record(load):
    """Return the record of the straight strip."""
    return {
        "word": "",
        "kinds": "",
        "periods": [],
        "regime": "straight",
        "P": load,
        "kappa": 0.0,
        "lam": [],
        "lengths": [1.0],
        "reactions": [],
        "V": 0.0,
        "shortening": 0.0,
        "max_theta": 0.0,
        "clearance": None,
    }


def is_new(found, kappa, p, tolerance=1e-9):
    """Tell whether (kappa, p) is not yet in the list, and add it."""
    for other_kappa, other_p in found:
        if abs(kappa - other_kappa) < tolerance * math.sqrt(p) and abs(p - other_p) < tolerance * p:
            return False
    found.append((kappa, p))
    return True


# ----------------------------------------------------------------------------------------------------------
# Load control
# ----------------------------------------------------------------------------------------------------------


def edge_nodes(setting, keys, p, kappa, table):
    """Return the kappa at which a kind of segment ceases to exist, each just inside its range."""
    edges = []
    for key in keys:
        if key not in table or key[1] == "0":
            continue
        valid = np.isfinite(table[key][1])
        for i in np.flatnonzero(valid[:-1] != valid[1:]):
            inside, outside = (kappa[i], kappa[i + 1]) if valid[i] else (kappa[i + 1], kappa[i])
            for _ in range(46):
                middle = (inside + outside) / 2
                low, high = beta_range(setting, key, p, middle)
                rises = [setting.segment(key, p, middle, lam_of_beta(p, middle, b))[1] for b in (low, high)]
                if low < high and (rises[0] > setting.rise(key)) != (rises[1] > setting.rise(key)):
                    inside = middle
                else:
                    outside = middle
            node = kappa[i] if valid[i] else kappa[i + 1]
            edges += [inside, inside + 1e-3 * (node - inside), inside + 0.1 * (node - inside)]
    return edges


def load_search(setting, load, max_contacts, count=500):
    """Return all admissible records at the load."""
    p = 4 * np.pi**2 * load
    limit = math.sqrt(2 * p)
    t = np.linspace(0, 1, count)
    kappa = limit * np.unique(np.concatenate([t**2, [1e-8, 1e-7]]))
    contact_keys, free_keys = available_keys(setting, p, kappa, max_contacts)
    table = tabulate(setting, contact_keys + free_keys, np.full(len(kappa), p), kappa)
    extra = edge_nodes(setting, contact_keys + free_keys, p, kappa, table)
    if extra:
        extra = np.array(sorted(set(float(e) for e in extra)))
        more = tabulate(setting, contact_keys + free_keys, np.full(len(extra), p), extra)
        order = np.argsort(np.concatenate([kappa, extra]), kind="stable")
        kappa = np.concatenate([kappa, extra])[order]
        table = {key: np.concatenate([table[key], more[key]], axis=1)[:, order] for key in table}
    table = {key: value for key, value in table.items() if np.isfinite(value[1]).any()}
    shortest = {key: np.nanmin(value[1]) for key, value in table.items()}
    records = [straight_record(load)]

    memory = {}

    def lam_at(key, k):
        if (key, k) not in memory:
            memory[key, k] = solve_lam(setting, key, p, k)
        return memory[key, k]

    def excess(k, weights):
        total = -1.0
        for key, number in weights.items():
            lam = lam_at(key, k)
            if math.isnan(lam):
                return math.nan
            total += number * float(setting.segment(key, p, k, lam)[0])
        return total

    def points(keys, spelled):
        weights = Counter(keys)
        total = sum(number * table[key][1] for key, number in weights.items()) - 1
        keep = np.ones(len(kappa) - 1, bool)
        if spelled:
            keep[:] = False
            tables = {key: table[key][0] for key in weights}
            for *_, chain in spelled:
                good = np.ones(len(kappa) - 1, bool)
                for value in reactions_of(chain, tables):
                    margin = 1e-6 * p + 2 * np.abs(value[1:] - value[:-1])
                    good &= ~(np.maximum(value[:-1], value[1:]) < -margin)
                keep |= good
        found = []
        for root in roots_of(lambda k: excess(k, weights), kappa, total, keep):
            if root < 1e-9 * limit:
                continue
            lams = {key: lam_at(key, root) for key in weights}
            exact = polish(setting, keys, root, lams, p, None, False)
            if exact is None:
                raise RuntimeError(f"no convergence at {keys}, kappa = {root}")
            if is_new(found, float(exact[0]), p):
                records.extend(make_records(setting, keys, spelled, *exact[:3], False))

    for key in free_keys:
        if key in table:
            before = len(records)
            points((key,), [])
            if setting.alike and key[1] == "S":
                records[before:] = [r for r in records[before:] if r["lam"][0] > -1e-9 * p]

    for first, last, middle in combinations(setting, shortest, max_contacts):
        spelled = spell(first, last, middle, setting.alike)
        keys = (first, *middle, last)
        points(keys, spelled)
        if line_possible(setting, keys):
            total = sum(table[key][1][0] for key in keys)
            if total <= 1:
                lams = {key: table[key][0][0] for key in keys}
                exact = polish(setting, keys, 0.0, lams, p, None, True)
                records.extend(make_records(setting, keys, spelled, *exact[:3], True, 1 - total))
    return records


def line_possible(setting, keys):
    """Tell whether a combination has a line regime of its own (clamped S and A coincide: S is counted)."""
    clamped = [key for key in keys if key[1] == "A" and setting.spring[key[0]] == math.inf]
    return not clamped and all(key[1] != "0" for key in keys)


# ----------------------------------------------------------------------------------------------------------
# Shortening control
# ----------------------------------------------------------------------------------------------------------


def shortening_search(setting, shortening, max_contacts, count_p=300, count_kappa=140):
    """Return all admissible records with the given shortening and 0 < P <= P_MAX."""
    loads = np.linspace(0, P_MAX, count_p + 1)[1:]
    loads = np.concatenate([loads[0] * np.array([0.05, 0.1, 0.2, 0.35, 0.5, 0.75]), loads, [P_MAX * 1.002]])
    thrust = 4 * np.pi**2 * loads
    ratio = np.concatenate([[0, 1e-6], np.linspace(0, 1, count_kappa)[1:] ** 1.5])
    shape = len(thrust), len(ratio)
    p = np.repeat(thrust, len(ratio))
    kappa = np.sqrt(2 * p) * np.tile(ratio, len(thrust))
    contact_keys, free_keys = available_keys(setting, p, kappa, max_contacts)
    table = tabulate(setting, contact_keys + free_keys, p, kappa, nodes=60)
    table = {key: value.reshape(3, *shape) for key, value in table.items() if np.isfinite(value[1]).any()}
    shortest = {key: np.nanmin(value[1]) for key, value in table.items()}
    records = []

    def add_points(keys, spelled):
        weights = Counter(keys)
        length = sum(number * table[key][1] for key, number in weights.items()) - 1
        short = sum(number * table[key][2] for key, number in weights.items()) - shortening
        if spelled:
            pull = sum(reactions_of(spelled[0][-1], {key: table[key][0] for key in weights}))
            length = np.where(pull < -0.05 * p.reshape(shape), np.nan, length)
        candidates = crossing_cells(length) & crossing_cells(short)
        found = []
        for i, j in np.argwhere(candidates):
            for a, b in ((i, j), (i, j + 1), (i + 1, j), (i + 1, j + 1)):
                lams = {key: table[key][0][a, b] for key in weights}
                if b == 0 or not all(math.isfinite(v) for v in lams.values()):
                    continue
                start = (kappa.reshape(shape)[a, b], thrust[a])
                rough = newton(setting, keys, *start, lams, shortening)
                if rough is None or not 0 < rough[2] <= 4 * np.pi**2 * P_MAX or rough[0] <= 1e-9:
                    continue
                if not is_new(found, rough[0], rough[2], 1e-7):
                    continue
                exact = polish(setting, keys, *rough, shortening, False)
                if exact is not None:
                    records.extend(make_records(setting, keys, spelled, *exact[:3], False))

    def add_lines(keys, spelled):
        weights = Counter(keys)
        excess = sum(number * table[key][2][:, 0] for key, number in weights.items()) - shortening

        def function(q):
            total = -shortening
            for key, number in weights.items():
                lam = solve_lam(setting, key, q, 0.0)
                part = setting.segment(key, q, 0.0, lam)
                total += number * float(part[0] - part[2])
            return total

        for q in roots_of(function, thrust, excess):
            lams = {key: solve_lam(setting, key, q, 0.0) for key in weights}
            exact = polish(setting, keys, 0.0, lams, q, shortening, True)
            if exact is None or float(exact[2]) > 4 * np.pi**2 * P_MAX:
                continue
            flat = 1 - sum(
                number * float(setting.segment(key, float(exact[2]), 0.0, float(exact[1][key]))[0])
                for key, number in weights.items()
            )
            if flat >= 0:
                records.extend(make_records(setting, keys, spelled, *exact[:3], True, flat))

    for key in free_keys:
        if key in table:
            before = len(records)
            add_points((key,), [])
            if setting.alike and key[1] == "S":
                records[before:] = [r for r in records[before:] if r["lam"][0] > -1e-9 * r["P"]]
    for first, last, middle in combinations(setting, shortest, max_contacts):
        spelled = spell(first, last, middle, setting.alike)
        keys = (first, *middle, last)
        add_points(keys, spelled)
        if line_possible(setting, keys):
            add_lines(keys, spelled)
    if shortening == 0:
        records.insert(0, straight_record(None))
    return records


def crossing_cells(values):
    """Return the cells of a 2-D table in or near which the zero contour may pass."""
    corners = np.stack([values[:-1, :-1], values[:-1, 1:], values[1:, :-1], values[1:, 1:]])
    known = np.isfinite(corners).any(axis=0)
    low = np.where(np.isfinite(corners), corners, np.inf).min(axis=0)
    high = np.where(np.isfinite(corners), corners, -np.inf).max(axis=0)
    with np.errstate(invalid="ignore"):
        reach = np.where(known, 0.5 * (high - low), 0)
        whole = np.isfinite(corners).all(axis=0)
        reach = np.where(whole, reach, 2 * reach + 0.02)
        return known & (low - reach <= 0) & (high + reach >= 0)


def newton(setting, keys, kappa, p, lams, shortening):
    """Solve for kappa, lam and p in double precision from a node of the table."""
    weights = Counter(keys)
    free = [key for key in weights if key[1] != "0"]
    unit = np.array([math.sqrt(p)] + [p] * (len(free) + 1))

    def residual_and_slope(x):
        k, q = x[0], x[-1]
        n = len(free)
        value = np.zeros(n + 2)
        slope = np.zeros((n + 2, n + 2))
        value[n:] = -1, -shortening
        for key, number in weights.items():
            at = 1 + free.index(key) if key in free else None
            lam = x[at] if at else 0.0
            hk, hl = min(1e-6 * unit[0], 1e-3 * k), 1e-6 * unit[-1]
            ks = np.array([k, k + hk, k - hk, k, k, k, k])
            qs = np.array([q, q, q, q + hl, q - hl, q, q])
            ls = np.array([lam, lam, lam, lam, lam, lam + hl, lam - hl])
            length, rise, advance = setting.segment(key, qs, ks, ls)
            for row, column in ((n, length), (n + 1, length - advance)):
                value[row] += number * column[0]
                slope[row, 0] += number * (column[1] - column[2]) / (2 * hk)
                slope[row, -1] += number * (column[3] - column[4]) / (2 * hl)
                if at:
                    slope[row, at] += number * (column[5] - column[6]) / (2 * hl)
            if at:
                value[at - 1] = rise[0] - setting.rise(key)
                slope[at - 1, 0] = (rise[1] - rise[2]) / (2 * hk)
                slope[at - 1, -1] = (rise[3] - rise[4]) / (2 * hl)
                slope[at - 1, at] = (rise[5] - rise[6]) / (2 * hl)
        return value, slope

    x = np.array([kappa] + [lams[key] for key in free] + [p])
    for _ in range(25):
        value, slope = residual_and_slope(x)
        if not np.all(np.isfinite(value)) or not np.all(np.isfinite(slope)):
            return None
        size = np.abs(value).max()
        if size < 1e-12:
            break
        try:
            move = np.linalg.solve(slope, value)
        except np.linalg.LinAlgError:
            return None
        move *= min(1, 0.2 / np.abs(move / unit).max())
        if x[0] - move[0] <= 0 or x[-1] - move[-1] <= 0:
            move *= 0.5 * min(x[0] / max(move[0], 1e-300) if move[0] > 0 else 1, 1)
        x = x - move
        if not 0 < x[0] < 1.02 * math.sqrt(2 * x[-1]) or abs(x[-1] - p) > 0.5 * p + 20:
            return None
    else:
        return None
    found = {key: 0.0 for key in weights}
    found.update(zip(free, x[1:-1], strict=True))
    return x[0], found, x[-1]


# ----------------------------------------------------------------------------------------------------------
# The interface
# ----------------------------------------------------------------------------------------------------------


def search(ends, P=None, H=None, max_contacts=4, shortening=None):
    """Return all admissible equilibria with at most max_contacts contacts and angles below 90 degrees.

    Parameters
    ----------
    ends : tuple of float
        Dimensionless springs (kA, kB): inf is clamped, 0 is pinned.
    P : float, optional
        Dimensionless load.
    H : float
        Wall distance from the line AB.
    max_contacts : int
        Largest number of contacts.
    shortening : float, optional
        Prescribed shortening instead of the load; then loads in (0, 12] are searched.

    Returns
    -------
    list of dict
        One record per state, mirror images counted once.
    """
    if (P is None) == (shortening is None):
        raise ValueError("give either P or shortening")
    setting = Setting(ends, H)
    if P is not None:
        records = load_search(setting, P, max_contacts)
    else:
        records = shortening_search(setting, shortening, max_contacts)
    return sorted(
        records,
        key=lambda r: (
            len(r["word"]),
            r["word"],
            r["kinds"],
            r["periods"],
            r["regime"],
            r["P"] or 0,
            r["kappa"],
        ),
    )


def integrate(record, ends, H):
    """Integrate the differential equation along a state and return its worst errors.

    Returns
    -------
    dict
        Errors of the wall heights, the contact angles, the end height, the end condition, the energy and the
        shortening, and the largest |y| - H (negative where there is room).
    """
    setting = Setting(ends, H)
    p, kappa = 4 * np.pi**2 * record["P"], record["kappa"]
    free = record["word"] == ""
    walls = [1 if letter == "U" else -1 for letter in record["word"]]
    lams = record["lam"]
    theta, bend = (float(v) for v in start_state(p, kappa, lams[0], setting.spring["A"], record["kinds"][0]))
    sign = 1
    if free:
        legs = [(1.0, lams[0], None)]
    else:
        legs = [(record["lengths"][0], walls[0] * lams[0], walls[0])]
        for i in range(1, len(walls)):
            legs.append((record["lengths"][i], walls[i] * lams[i], walls[i]))
        legs.append((record["lengths"][-1], -walls[-1] * lams[-1], None))
    ends_energy = 0.0
    c = setting.spring["A"]
    if 0 < c < math.inf:
        ends_energy += c * theta**2 / 2
    state = np.array([sign * theta, sign * bend, 0, 0, 0])
    errors = {"height": 0.0, "angle": 0.0, "above": -H}
    position = record.get("flat", 0.0)
    for length, lam, wall in legs:

        def rates(_, u, lam=lam):
            return [
                u[1],
                -p * np.sin(u[0]) + lam * np.cos(u[0]),
                np.sin(u[0]),
                1 - np.cos(u[0]),
                u[1] ** 2 / 2 - p * (1 - np.cos(u[0])),
            ]

        out = solve_ivp(
            rates, (0, length), state, method="DOP853", rtol=1e-12, atol=1e-14, max_step=length / 60
        )
        state = out.y[:, -1]
        position += length
        errors["above"] = max(errors["above"], np.abs(out.y[2]).max() - H)
        if wall:
            errors["height"] = max(errors["height"], abs(state[2] - wall * H))
            errors["angle"] = max(errors["angle"], abs(state[0]))
            state[0], state[2] = 0.0, wall * H
            state[1] = -wall * kappa
    c = setting.spring["B"]
    errors["end"] = abs(state[2])
    errors["condition"] = abs(state[0]) if c == math.inf else abs(state[1] + c * state[0]) / max(1, c)
    if 0 < c < math.inf:
        ends_energy += c * state[0] ** 2 / 2
    errors["length"] = abs(position - 1)
    errors["V"] = abs(state[4] + ends_energy - record["V"])
    errors["shortening"] = abs(state[3] - record["shortening"])
    return errors


def rounded(value, digits):
    """Round a float to significant digits (None and other values pass)."""
    return float(f"{value:.{digits}g}") if isinstance(value, float) else value


COLUMNS = ["label", "P", "kappa", "V", "shortening", "margin"]


def compact(record, problem):
    """Return a record as a short row, see COLUMNS (P only if the shortening was prescribed).

    The label is 'word kinds periods regime', for example 'UDU SA 0010 point'; a free state has a mode number
    in place of the word, the straight strip is '0 straight'. The margin tells how far the state is from not
    being listed: the least of reaction/P, clearance/H, 90 degrees less its angle, and P_MAX - P.
    """
    name = record["word"] or str(record.get("mode", 0))
    parts = [name, record["kinds"], "".join(str(j) for j in record["periods"]), record["regime"]]
    row = [" ".join(part for part in parts if part)]
    margins = [QUARTER - record["max_theta"], *(reaction / record["P"] for reaction in record["reactions"])]
    if record["clearance"] is not None:
        margins.append(record["clearance"] / problem["H"])
    if "shortening" in problem:
        row.append(rounded(record["P"], 10))
        margins.append(P_MAX - record["P"])
    row += [rounded(record[name], 10) for name in ("kappa", "V", "shortening")]
    return [*row, rounded(float(min(margins)), 2)]


def draw(random, share):
    """Draw one problem: ends, H and either P or shortening."""

    def end():
        which = random.integers(3)
        return (math.inf, 0.0, float(f"{10 ** random.uniform(-2, 2):.6g}"))[which]

    first = end()
    last = first if random.random() < 0.5 else end()
    problem = {"ends": [first, last], "H": round(float(random.uniform(0.01, 0.15)), 6)}
    if random.random() < share:
        problem["shortening"] = round(float(random.uniform(0, 0.1)), 7)
    else:
        problem["P"] = round(float(random.uniform(0, P_MAX)), 6)
    return problem


def main():
    """Search random points and write the results."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, default=40)
    parser.add_argument("--contacts", type=int, default=4)
    parser.add_argument("--share", type=float, default=0.0, help="share of points with prescribed shortening")
    parser.add_argument("--full", action="store_true", help="write complete records instead of short rows")
    parser.add_argument("--out", default="search_points.json")
    args = parser.parse_args()
    random = np.random.default_rng(args.seed)
    points = []
    for number in range(args.count):
        problem = draw(random, args.share)
        start = time.perf_counter()
        states = search(
            tuple(problem["ends"]),
            P=problem.get("P"),
            H=problem["H"],
            max_contacts=args.contacts,
            shortening=problem.get("shortening"),
        )
        problem["ends"] = ["inf" if math.isinf(k) else k for k in problem["ends"]]
        if args.full:
            rows = [{key: value for key, value in state.items() if value is not None} for state in states]
        else:
            rows = [compact(state, problem) for state in states]
        points.append({**problem, "states": rows})
        seconds = time.perf_counter() - start
        print(f"{number + 1}/{args.count}  {problem}  {len(states)} states  {seconds:.1f} s", flush=True)
        result = {
            "seed": args.seed,
            "contacts": args.contacts,
            "columns": None if args.full else COLUMNS,
            "points": points,
        }
        with open(args.out, "w", encoding="utf-8") as file:
            json.dump(result, file, separators=(",", ":"))


if __name__ == "__main__":
    main()
