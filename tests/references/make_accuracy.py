"""References of `elastica accuracy`: two clamped strips to 22 digits, from 60 working digits.

Equilibria and eigenvalues come from `make_states`; the heights along the strip from Taylor series of its
equation. Imports nothing from the package.

Run ``python -m references.make_accuracy`` in the folder ``tests`` to write
``studies/accuracy/references.json``.
"""

import json
from pathlib import Path

from mpmath import mp, mpf
from references.make_states import WORKING_DIGITS, _text, end_values, equilibrium, integrate_shape, reference

CASES = {"free": ("B1", 1.2, 0.45), "contact": ("U", 2.5, 0.1)}
ENDS = "clamped-clamped"
SAMPLES = 21
OUTPUT = Path(__file__).parents[2] / "studies" / "accuracy" / "references.json"


def heights(state, P, H):
    """|y| at `SAMPLES` equidistant arc lengths; both states are symmetric about the middle."""
    with mp.workdps(WORKING_DIGITS):
        kappa, p, segments = equilibrium(state, ENDS, P, H)
        first = segments[0]
        (theta, curvature), _ = end_values(first.kind, kappa, first.lam, p)
        y, values = mpf(0), [mpf(0)]
        for _ in range(SAMPLES // 2):
            theta, curvature, rise, _ = integrate_shape(
                theta, curvature, first.lam, p, mpf(1) / (SAMPLES - 1), 4
            )
            y += rise
            values.append(abs(y))
        return [_text(value) for value in [*values, *values[-2::-1]]]


def main():
    cases = {
        name: reference(state, ENDS, P, H) | {"y": heights(state, P, H)}
        for name, (state, P, H) in CASES.items()
    }
    OUTPUT.write_text(json.dumps(cases, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
