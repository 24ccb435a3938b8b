"""The chain of links with O(N) algebra, started from the exact state: a little in its favour."""

import time
from typing import NamedTuple

import numpy as np

import elastica
from elastica.chain.bordered import lowest
from elastica.chain.profile import Profile
from elastica.chain.properties import outline
from elastica.chain.published import published_equilibrium, published_variation
from elastica.chain.second_variation import floor, second_variation
from elastica.chain.splitting import strip_of
from elastica.chain.start import Target, exact_start
from elastica.chain.verdict import judge
from elastica.ends import parse_ends
from elastica.scales import FOUR_PI_SQUARED
from studies.accuracy.scenes import SAMPLES, Answer

ORDERS = {"published": 1, "consistent": 2}


class Start(NamedTuple):
    """Where Newton's method starts on a chain, and what it solves for."""

    strip: object
    target: Target
    state: object


def start(scene, links):
    """The exact state in the unknowns of a chain of `links` links."""
    exact = elastica.solve(scene.state, P=[scene.P], H=scene.H)
    strip = strip_of(links, Profile(), parse_ends("clamped-clamped"))
    rising = np.array([1, -1] if exact.state.word else [1])
    target = Target(scene.H, FOUR_PI_SQUARED * scene.P, None)
    return Start(strip, target, exact_start(exact, 0, strip, rising))


def chain(scene, links, setting):
    """One state of a chain in the `setting` "published" or "consistent"."""
    begin = start(scene, links)
    published = setting == "published"
    clock = [time.perf_counter()]
    state = begin.target.solve(begin.strip, begin.state.pattern, begin.state)
    if published:
        state = published_equilibrium(state)
    clock.append(time.perf_counter())
    index = judge(state, published).index
    clock.append(time.perf_counter())
    form = (published_variation if published else second_variation)(state)
    eigenvalue = lowest(form, floor(state), 1)[0]
    clock.append(time.perf_counter())
    line = outline(state)
    y = np.interp(np.linspace(0, 1, SAMPLES), line.s, line.y)
    clock.append(time.perf_counter())
    solving, judging, spectrum, sampling = np.diff(clock)
    bent, shorter = energies(state)
    return Answer(
        {
            "equilibrium": solving,
            "index": solving + judging,
            "eigenvalue": solving + spectrum,
            "shape": solving + judging + sampling,
        },
        (bent - state.p * shorter) / FOUR_PI_SQUARED,
        shorter,
        index,
        eigenvalue,
        y,
    )


def energies(state):
    """Bending energy (EI = L = 1) and shortening of a chain."""
    links = state.pieces.chain
    return links.bending_energy(state.theta), links.shortening(state.theta)


def extrapolated(coarse, fine, setting):
    """Richardson's combination of the answers of N and 2N links; seconds add up."""
    weight = 2 ** ORDERS[setting]

    def combine(a, b):
        return (weight * b - a) / (weight - 1)

    return Answer(
        {task: coarse.seconds[task] + fine.seconds[task] for task in fine.seconds},
        combine(coarse.energy, fine.energy),
        combine(coarse.shortening, fine.shortening),
        fine.index,
        combine(coarse.eigenvalue, fine.eigenvalue),
        combine(coarse.y, fine.y),
    )
