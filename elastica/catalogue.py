"""All states that exist at a point: every name up to a number of contacts, every root, in one search.

Left out: names themselves (`states`), the search along κ (`sweep`, `equilibrium`).
"""

from dataclasses import dataclass, fields

import numpy as np

from elastica.codes import Stability, Status
from elastica.ends import Ends, parse_ends
from elastica.equilibrium import CHUNK, every, find
from elastica.properties import bent, straight
from elastica.scales import FOUR_PI_SQUARED
from elastica.solution import broadcast, unusable
from elastica.states import parse_state, states
from elastica.sweep import Table

PER_CONTACT = ("reaction", "contact_position")


@dataclass(frozen=True, eq=False)
class FoundStates:
    """Equilibria, one row each; rows are sorted by point, then by energy.

    Attributes
    ----------
    ends : Ends
    point : ndarray of int, shape (rows,)
        Flat index of the point in the broadcast arrays of P and H.
    state : ndarray of str, shape (rows,)
        Canonical name, with the number of the root.
    P, H : ndarray, shape (rows,)
    status, stability, index, nullity, curvature, energy, bending_energy, shortening, flat_length, max_slope,
    clearance, error : ndarray, shape (rows,)
        As in `Solution`.
    reaction, contact_position : ndarray, shape (rows, contacts)
        NaN beyond the contacts of the state.
    reasons : dict of int to str
        Why a point failed, by its flat index.
    """

    ends: Ends
    point: np.ndarray
    state: np.ndarray
    P: np.ndarray
    H: np.ndarray
    status: np.ndarray
    stability: np.ndarray
    index: np.ndarray
    nullity: np.ndarray
    curvature: np.ndarray
    energy: np.ndarray
    bending_energy: np.ndarray
    shortening: np.ndarray
    flat_length: np.ndarray
    max_slope: np.ndarray
    clearance: np.ndarray
    error: np.ndarray
    reaction: np.ndarray
    contact_position: np.ndarray
    reasons: dict

    def __len__(self):
        """Number of rows."""
        return self.point.size

    def __str__(self):
        """One line a state."""
        lines = [
            f"{'P':>10} {'H':>10}  {'state':<10} {'stability':<22} {'index':>5} {'energy':>16} {'shortening':>12}"
        ]
        for row in range(len(self)):
            lines.append(
                f"{self.P[row]:>10.6g} {self.H[row]:>10.6g}  {self.state[row]:<10} "
                f"{Stability(int(self.stability[row])).name.lower():<22} {self.index[row]:>5} "
                f"{self.energy[row]:>16.9g} {self.shortening[row]:>12.6g}"
            )
        return "\n".join(lines)


def find_states(P, H, ends="clamped-clamped", max_contacts=3):
    """All admissible equilibria at every point of broadcast arrays.

    Complete for |θ| < 90° up to `max_contacts` contacts (and 8 further full periods); of steeper states
    those that continue a branch of alternating contacts or of free buckling.

    Parameters
    ----------
    P, H : array_like
        Load and half gap, as in `solve`.
    ends : str
    max_contacts : int
        From 0 to 10.

    Returns
    -------
    FoundStates

    Raises
    ------
    ValueError
        If the ends, the number of contacts or the shapes of P and H make no sense.

    Examples
    --------
    >>> find_states(P=6.0, H=0.1, max_contacts=2).state.tolist()
    ['UD', 'UDa', 'U-', 'UU', 'U', '0']
    """
    ends = parse_ends(ends)
    names = states(ends, max_contacts)
    P, H, _ = broadcast(P=P, H=H)
    reasons = unusable(P, H)
    good = np.setdiff1d(np.arange(P.size), list(reasons))
    rows = [
        (point[keep], name[keep], {key: value[keep] for key, value in values.items()})
        for point, name, values in _search(names, ends, P[good], H[good], admissible=True)
        for keep in [values["status"] == Status.SOLVED]
    ]
    return _table(ends, rows, good, P, H, reasons, max_contacts)


def _search(names, ends, P, H, admissible=False):
    """Solve names and all further roots of the words among them.

    Parameters
    ----------
    admissible : bool
        Leave out what has a negative reaction before its properties are computed.

    Yields
    ------
    points : ndarray of int, shape (m,)
    names : ndarray of str, shape (m,)
    values : dict of str to ndarray, shape (m, ...)
    """
    with np.errstate(all="ignore"):
        # By load, so that few points share a chunk with loads that have room for more periods.
        for points in np.array_split(np.argsort(P, kind="stable"), max(1, -(-P.size // CHUNK))):
            load, gap = P[points], H[points]
            p = FOUR_PI_SQUARED * load
            pressed = np.flatnonzero(p > 0)
            table = Table(p[pressed], gap[pressed])
            for name in names:
                state = parse_state(name, ends)
                if state.straight:
                    yield points, np.full(points.size, name), straight(state, ends, load, gap)
                    continue
                if state.mode:
                    found = find(state, ends, p, gap)
                else:
                    found = every(state, ends, p[pressed], gap[pressed], table)
                    found = found._replace(point=pressed[found.point])
                if admissible:
                    pull = np.abs(found.lam).max(axis=0, initial=0)
                    pushes = (found.lam[:-1] + found.lam[1:] >= -1e-9 * pull).all(axis=0)
                    found = found.at(pushes | (found.kappa == 0))
                if not found.point.size:
                    continue
                roots = [name, *(f"{name}:{number}" for number in range(2, found.number.max() + 1))]
                own = found.point
                values = bent(state, ends, load[own], gap[own], found)
                yield points[own], np.array(roots)[found.number - 1], values


def _table(ends, rows, good, P, H, reasons, contacts):
    """Rows of all states as columns, sorted by point and energy."""
    columns = {}
    for name in (f.name for f in fields(FoundStates)):
        if name in ("ends", "point", "state", "P", "H", "reasons"):
            continue
        parts = [values[name] for _, _, values in rows]
        if name in PER_CONTACT:
            parts = [np.pad(p, ((0, 0), (0, contacts - p.shape[1])), constant_values=np.nan) for p in parts]
        columns[name] = np.concatenate(parts)
    point = good[np.concatenate([point for point, _, _ in rows])]
    order = np.lexsort((columns["energy"], point))
    state = np.concatenate([names for _, names, _ in rows])[order]
    columns = {name: values[order] for name, values in columns.items()}
    point = point[order]
    return FoundStates(ends, point, state, P[point], H[point], **columns, reasons=reasons)
