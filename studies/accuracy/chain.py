"""The chain of links with O(N) algebra, started from the exact state: a little in its favour.

Not here: the same chain with full matrices (`dense`).
"""

import time

import numpy as np

import elastica
from elastica.chain.bordered import lowest
from elastica.chain.equilibrium import equilibrium
from elastica.chain.profile import Profile
from elastica.chain.properties import outline
from elastica.chain.settings import SETTINGS
from elastica.chain.spectrum import floor
from elastica.chain.splitting import mesh_of
from elastica.chain.start import exact_start
from elastica.chain.verdict import judge
from elastica.scales import FOUR_PI_SQUARED
from elastica.scene import Scene
from studies.accuracy.cases import SAMPLES, Answer

ORDERS = {"published": 1, "consistent": 2}


def start(case, links):
    """The exact state in the unknowns of a chain of `links` links."""
    exact = elastica.solve(case.state, P=[case.P], H=case.H)
    return exact_start(exact, 0, mesh_of(links, Profile()), Scene(exact.ends, case.H))


def chain(case, links, clamp):
    """One state of a chain in the setting `clamp`."""
    begin = start(case, links)
    setting = SETTINGS[clamp]
    clock = [time.perf_counter()]
    state = setting.settled(equilibrium(begin.mesh, begin.contacts, begin))
    clock.append(time.perf_counter())
    index = judge(state, setting).index
    clock.append(time.perf_counter())
    eigenvalue = lowest(setting.second_variation(state), floor(state), 1)[0]
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


def extrapolated(coarse, fine, clamp):
    """Richardson's combination of the answers of N and 2N links; seconds add up."""
    weight = 2 ** ORDERS[clamp]

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
