"""All states that exist at a point: every name up to a number of contacts, every root, in one search.

Not here: names themselves (`state`), how the roots of one name are found (`equilibria`).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from elastica.codes import Status
from elastica.control import CONTROLS, LOAD, read_control
from elastica.ends import Ends, parse_ends
from elastica.equilibria.roots import CHUNK
from elastica.exact import equilibria_at, solve
from elastica.inputs import broadcast
from elastica.labelled import labels_of_rows
from elastica.properties import QUANTITIES, Quantities, documented
from elastica.rows import Rows, failures
from elastica.scene import Scene
from elastica.solution import solution_of, unfollowed, unusable
from elastica.state import parse_state, states

COLUMNS = sorted(QUANTITIES, key=lambda name: (name not in ("P", "H"), QUANTITIES[name].along))
"""Where a state is, what it is, and what there is for each of its contacts."""


@documented
@dataclass(frozen=True, eq=False, repr=False)
class FoundStates(Rows, Quantities):
    """Equilibria, one row each, by point and then by energy, at prescribed shortening by bending energy.

    ``for found in find_states(…)`` gives one row after the other, `to_dataframe` a table of pandas.

    Attributes
    ----------
    ends : Ends
    control : str
        "P" or "shortening": what is prescribed.
    point : ndarray of int, shape (rows,)
        Flat index of the point in the broadcast arrays of P and H.
    state : ndarray of str, shape (rows,)
        Canonical name, with the number of the root.
    {quantities}
    reasons : dict of int to str
        Why a point failed, by its flat index.
    not_followed : dict of int to tuple of str
        States that may be there beyond the end of the search, by the flat index of the point: steeper than
        90°, as a rule. They are no rows.
    labels : dict of str to ndarray, shape (rows,)
        Where P or H is a DataArray, labels of the point along each dimension; of one that has the name of
        a column and other values, as ``P_label``.
    """

    row_name = "FoundState"
    columns = ("point", "state", *COLUMNS)

    ends: Ends
    control: str
    point: np.ndarray
    state: np.ndarray
    reasons: dict[int, str]
    not_followed: dict[int, tuple[str, ...]]
    labels: dict[str, np.ndarray]

    def __str__(self) -> str:
        """One line a state."""
        least = CONTROLS[self.control].potential
        heads = f"{'P':>10} {'H':>10}  {'state':<10} {'stability':<22} {'index':>5}"
        lines = [f"{heads} {least:>16} {'shortening':>12}"]
        lines += [
            f"{row.P:>10.6g} {row.H:>10.6g}  {row.state:<10} {row.stability!s:<22} {row.index:>5} "
            f"{getattr(row, least):>16.9g} {row.shortening:>12.6g}"
            for row in self
        ]
        if self.not_followed:
            names = dict.fromkeys(name for some in self.not_followed.values() for name in some)
            lines.append(f"not followed, mostly beyond 90 degrees: {' '.join(names)}")
        return "\n".join([*lines, *failures(self.reasons)])


def find_states(
    P: ArrayLike | None = None,
    H: ArrayLike | None = None,
    ends: str | Ends = "clamped-clamped",
    max_contacts: int = 3,
    shortening: ArrayLike | None = None,
) -> FoundStates:
    """All admissible equilibria at every point of broadcast arrays.

    Complete for |θ| < 90° up to `max_contacts` contacts and 8 extra full periods (3 at prescribed
    shortening); of steeper states those that continue a branch of alternating contacts or of free
    buckling.

    Parameters
    ----------
    P, H, ends, shortening
        As in `solve`.
    max_contacts : int
        From 0 to 10.

    Returns
    -------
    FoundStates

    Raises
    ------
    ValueError
        As `solve` does, and if the number of contacts makes no sense.

    Examples
    --------
    >>> find_states(P=6.0, H=0.1, max_contacts=2).state.tolist()
    ['UD', 'UDa', 'U-', 'UU', 'U', '0']
    """
    ends = parse_ends(ends)
    names = states(ends, max_contacts)
    control, values = read_control(P, shortening)
    prescribed, H, _, labels = broadcast(**{control.name: values, "H": H})
    scene = Scene(ends, H)
    reasons = unusable(scene, control, prescribed)
    good = np.setdiff1d(np.arange(prescribed.size), list(reasons))
    found = search(names, scene.at(good), control, prescribed[good], admissible=True)
    rows: list[tuple] = []
    lost: dict[int, list[str]] = {}
    for point, number, solution in found:
        name = solution.state.name
        roots = np.array([name, *(f"{name}:{n}" for n in range(2, number.max(initial=1) + 1))])
        for i in np.flatnonzero(solution.status == Status.NOT_FOLLOWED):
            lost.setdefault(int(good[point[i]]), []).append(str(roots[number[i] - 1]))
        keep = np.flatnonzero(solution.status == Status.SOLVED)
        rows.append((good[point[keep]], roots[number[keep] - 1], solution, keep))
    columns = {
        name: np.concatenate([_padded(getattr(s, name), max_contacts)[keep] for *_, s, keep in rows])
        for name in COLUMNS
    }
    point, state = (np.concatenate([row[i] for row in rows]) for i in (0, 1))
    order = np.lexsort((columns[control.potential], point))
    columns = {name: values[order] for name, values in columns.items()}
    point = point[order]
    return FoundStates(
        ends,
        control.name,
        point,
        state[order],
        **columns,
        reasons=reasons,
        not_followed={at: tuple(names) for at, names in sorted(lost.items())},
        labels={} if labels is None else labels_of_rows(labels, point, columns),
    )


def _padded(values, contacts):
    """Values of each contact filled up with NaN; others as they are."""
    if values.ndim == 1:
        return values
    return np.pad(values, ((0, 0), (0, contacts - values.shape[1])), constant_values=np.nan)


def search(names, scene, control, prescribed, admissible=False):
    """Solve names and all higher roots of the words among them.

    Where there may be more roots beyond the end of the search, the next one is `not_followed`.

    Parameters
    ----------
    names : sequence of str
        Canonical, without root numbers.
    scene : Scene
    control : Control
    prescribed : ndarray, shape (n,)
        Possible loads or shortenings.
    admissible : bool
        Leave out what has a negative reaction before its properties are computed.

    Yields
    ------
    points : ndarray of int, shape (m,)
    numbers : ndarray of int, shape (m,)
        Of the roots.
    values : Solution
        Of the first root's name, shape (m,).
    """
    parsed = [parse_state(name, scene.ends) for name in names]
    longest = max((len(state.word) for state in parsed), default=0)
    with np.errstate(all="ignore"):
        # By load, so that few points share a chunk with loads that have room for more periods; by gap, so
        # that a branch serves many points.
        order = np.argsort(prescribed if control == LOAD else scene.H, kind="stable")
        for points in np.array_split(order, max(1, -(-prescribed.size // CHUNK))):
            here, values = scene.at(points), prescribed[points]
            equilibria = equilibria_at(here, control, values, longest)
            for state in parsed:
                if state.straight:
                    yield points, np.ones_like(points), solve(state, here, control, values)
                    continue
                found, beyond = equilibria.every(state)
                if beyond.any():
                    own = np.flatnonzero(beyond)
                    numbers = np.bincount(found.point, minlength=beyond.size)[own] + 1
                    yield points[own], numbers, unfollowed(state, here.at(own), control, values[own])
                if admissible:
                    pull = np.abs(found.lam).max(axis=0, initial=0)
                    pushes = (found.lam[:-1] + found.lam[1:] >= -1e-9 * pull).all(axis=0)
                    found = found.at(pushes | (found.kappa == 0))
                if found.point.size:
                    own = found.point
                    solution = solution_of(state, here.at(own), control, values[own], found)
                    yield points[own], found.number, solution
