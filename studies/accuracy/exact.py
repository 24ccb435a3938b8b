"""The exact solver in blocks and one call at a time, and its elements with a given number of terms."""

import time

import numpy as np

import elastica
from elastica.stability.spectrum import eigenvalues
from studies.accuracy.cases import SAMPLES, Answer

SPREAD = 0.1
"""Points of a block lie within this relative distance in load of the case's, which comes first."""
SHAPES = 500
"""Points of a block whose shapes are sampled: all of 10,000 would be 48 MB."""


def exact(case, size):
    """A block of `size` states that begins with the case; seconds are per state."""
    P, H = _block(case, size)
    begin = time.perf_counter()
    s = elastica.solve(case.state, P=P, H=H)
    solving = (time.perf_counter() - begin) / size
    begin = time.perf_counter()
    lowest = s.eigenvalues(1)
    spectrum = (time.perf_counter() - begin) / size
    few = elastica.solve(case.state, P=P[:SHAPES], H=H[:SHAPES])
    begin = time.perf_counter()
    shape = few.shape(SAMPLES)
    sampling = (time.perf_counter() - begin) / few.P.size
    return Answer(
        {
            "equilibrium": solving,
            "index": solving,
            "eigenvalue": solving + spectrum,
            "shape": solving + sampling,
        },
        s.energy[0],
        s.shortening[0],
        int(s.index[0]),
        lowest[0, 0],
        shape.y[0],
    )


def spectral(case, terms, size=1000):
    """The lowest eigenvalue from elements with `terms` Legendre terms each."""
    P, H = _block(case, size)
    begin = time.perf_counter()
    s = elastica.solve(case.state, P=P, H=H)
    lowest = eigenvalues(s, 1, terms=terms)
    seconds = (time.perf_counter() - begin) / size
    return Answer({"eigenvalue": seconds}, s.energy[0], s.shortening[0], None, lowest[0, 0])


def _block(case, size):
    """Loads and gaps near the case's, upwards: towards the Euler load there might be no state."""
    P = case.P * (1 + SPREAD * np.random.default_rng(0).random(size))
    P[0] = case.P
    return P, np.full(size, case.H)
