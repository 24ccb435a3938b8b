"""Run as a script: time per solve and per index against the number of links, beside the dense procedure.

python tests/bench/chain_speed.py [FIGURE.png]
"""

import sys
import time

import matplotlib.pyplot as plt
import numpy as np

import elastica
from elastica.chain import consistent
from elastica.chain.bordered import lowest
from elastica.chain.equilibrium import equilibrium
from elastica.chain.profile import Profile
from elastica.chain.spectrum import floor
from elastica.chain.splitting import mesh_of
from elastica.chain.start import exact_start
from elastica.chain.verdict import judge
from elastica.scene import Scene

P, H = 2.5, 0.1
LINKS = (100, 200, 400, 800, 1000, 1600, 3200, 10_000, 31_623, 100_000)
DENSE = (200, 800, 1600)
NEWTON_STEPS = 4


def best(action, repeats):
    times = []
    for _ in range(repeats):
        begin = time.perf_counter()
        action()
        times.append(time.perf_counter() - begin)
    return min(times)


def sparse_procedure(exact, n):
    """A chain of n links, and seconds of its equilibrium, index and three lowest eigenvalues."""
    start = exact_start(exact, 0, mesh_of(n, Profile()), Scene(exact.ends, H))
    state = equilibrium(start.mesh, start.contacts, start)
    solving = best(lambda: equilibrium(start.mesh, start.contacts, start), 7)
    judging = best(lambda: judge(state, consistent), 7)
    spectrum = best(lambda: lowest(consistent.second_variation(state), floor(state), 3), 3)
    return state, solving, judging, spectrum


def dense_procedure(state):
    """Seconds of Newton's steps with a full matrix, and of all eigenvalues on the constraints' null space."""
    form = consistent.second_variation(state)
    T = np.diag(form.diagonal) + np.diag(form.off, 1) + np.diag(form.off, -1)
    K = np.block([[T, form.border], [form.border.T, form.corner]])

    def index():
        Z = np.linalg.qr(form.border, mode="complete")[0][:, form.constraints :]
        np.linalg.eigvalsh(Z.T @ T @ Z)

    return NEWTON_STEPS * best(lambda: np.linalg.solve(K, np.ones(K.shape[0])), 2), best(index, 2)


def main():
    exact = elastica.solve("U", P=[P], H=H)
    rows, dense = [], []
    for n in LINKS:
        state, solving, judging, spectrum = sparse_procedure(exact, n)
        rows.append((n, solving, judging, spectrum))
        line = "{:7d} links: solve {:8.2f}  index {:7.2f}  3 eigenvalues {:8.2f}".format(
            n, *np.multiply(1e3, rows[-1][1:])
        )
        if n in DENSE:
            newton, index = dense_procedure(state)
            dense.append((n, newton, index))
            ratio = (newton + index) / (solving + judging)
            line += f"   dense {1e3 * newton:7.1f} + {1e3 * index:7.1f}: {ratio:.0f} times"
        print(line, "ms", flush=True)
    table = np.log(np.array(rows))
    for name, column in zip(("solve", "index", "eigenvalues"), table.T[1:], strict=True):
        print(f"slope of {name}: {np.polyfit(table[:, 0], column, 1)[0]:.2f}", end="  ")
        print(f"from 1,000 links: {np.polyfit(table[4:, 0], column[4:], 1)[0]:.2f}")
    if len(sys.argv) > 1:
        draw(np.array(rows), np.array(dense), sys.argv[1])


def draw(rows, dense, path):
    figure, axes = plt.subplots(figsize=(6, 4.5), layout="constrained")
    for column, name in enumerate(("equilibrium", "index", "three eigenvalues"), 1):
        axes.loglog(rows[:, 0], 1e3 * rows[:, column], "o-", label=name)
    for column, name in enumerate(("equilibrium, dense", "index, dense"), 1):
        axes.loglog(dense[:, 0], 1e3 * dense[:, column], "s--", label=name)
    links = rows[[4, -1], 0]
    axes.loglog(links, 1e3 * rows[4, 1] * links / links[0], "k:", label="proportional to the links")
    axes.set(xlabel="links", ylabel="time of one state [ms]", title=f"Chain, clamped U, P = {P}, H = {H}")
    axes.legend()
    figure.savefig(path, dpi=150)


if __name__ == "__main__":
    main()
