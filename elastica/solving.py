"""Solve a named state on arrays of load and gap.

Arguments are read and points paired here.

Not here: how a state is found, in closed form (`exact`) or as one of a chain (`chain`).
"""

from typing import Any

from numpy.typing import ArrayLike

from elastica import exact
from elastica.control import read_control
from elastica.ends import Ends, parse_ends
from elastica.inputs import broadcast
from elastica.labelled import LabelledSolution
from elastica.scene import Scene
from elastica.solution import Solution, shaped
from elastica.spelling import did_you_mean, shown
from elastica.state import parse_state

METHODS = ("exact", "chain")


def solve(
    state: str,
    *,
    P: ArrayLike | None = None,
    H: ArrayLike | None = None,
    ends: str | Ends = "clamped-clamped",
    shortening: ArrayLike | None = None,
    method: str = "exact",
    links: int | None = None,
    clamp: str | None = None,
    stiffness: Any = None,
) -> Solution:
    """Find a state, its admissibility and its stability at every point of broadcast arrays.

    Either the load or the shortening is prescribed. Arrays broadcast as in NumPy, DataArrays of xarray by
    the names of their dimensions; the answer then consists of DataArrays with the same coordinates.
    Quantities of pint must be dimensionless. What has a unit, a mask or labels of pandas is refused.

    Parameters
    ----------
    state : str
        Name such as "0", "B1", "U", "Ua", "U-", "UD:2".
    P : array_like, optional
        Load P*L²/(4π²EI), from 0 to 1e6.
    H : array_like
        Half gap H*/L, from 1e-50 on: the walls are at y = H and y = −H. Each element is a point of its
        own, so that ``H=[0.1, 0.05]`` asks about two gaps, not about two walls at different distances.
    ends : str
        "clamped-clamped" (default) or any other pair of "clamped", "pinned" and spring constants k ≥ 0,
        such as "clamped-pinned", "0.3/2.5" or "clamped/2.5"; springs but 0 from 1e-12 to 1e12.
    shortening : array_like, optional
        Approach of the ends ΔL*/L, 0 or from 1e-11 to 2. `P` is then part of the answer, and stability is
        that at fixed shortening. Free shapes without a force across (both ends pinned, or clamped and an
        odd mode) are known up to 1.994; all others are `not_followed` beyond the greatest shortening of
        their branches, which end at 90 degrees, alternating words and free shapes later.
    method : str
        "exact" (default), or "chain" for rigid links and springs.
    links : int, optional
        Of the chain: 400 by default.
    clamp : str, optional
        Of the chain: "consistent" (default) or "published".
    stiffness : float, array_like or callable, optional
        Of the chain: the profile of EI along the strip; see `elastica.chain.solution.solve`.

    Returns
    -------
    Solution

    Raises
    ------
    ValueError
        If the state, the ends or the shapes of the arrays make no sense, an array holds no real numbers, or
        not exactly one of P and shortening is given. A bad number inside an array makes that point
        `failed`, with its reason in `reasons`, and nothing else.

    Examples
    --------
    >>> s = solve("U", P=[2.5, 2.6], H=0.1)
    >>> s.status.tolist(), s.stability.tolist()
    ([0, 0], [0, 0])
    >>> s = solve("Ua", shortening=0.02, H=0.05)
    >>> print(s.P.round(4), s.index, solve("Ua", P=s.P, H=0.05).index)
    2.1772 0 1
    """
    options = {"links": links, "clamp": clamp, "stiffness": stiffness}
    options = {name: value for name, value in options.items() if value is not None}
    if method not in METHODS:
        question = did_you_mean(method, METHODS)
        raise ValueError(f"method = {shown(method)} is not known{question}; use {' or '.join(METHODS)}")
    if options and method != "chain":
        raise ValueError(f"{', '.join(sorted(options))}: of a chain only; add method='chain'")
    ends = parse_ends(ends)
    state = parse_state(state, ends)
    control, values = read_control(P, shortening)
    prescribed, H, shape, labels = broadcast(**{control.name: values, "H": H})
    if method == "chain":
        # Few ask for a chain; to load it takes as long as half of all the rest.
        from elastica.chain.solution import solve as solve_chain

        solution = solve_chain(state, Scene(ends, H), control, prescribed, **options)
    else:
        solution = exact.solve(state, Scene(ends, H), control, prescribed)
    solution = shaped(solution, shape)
    return solution if labels is None else LabelledSolution.of(solution, labels)
