"""Dimensionless quantities and those with EI = L = 1, in which the solvers work.

The load P counts Euler loads of the clamped strip, P = P*L²/(4π²EI); the thrust is p = 4π²P. Reactions and
energies are divided by 4π² on the way out, lengths and curvatures are the same in both.
"""

import numpy as np

FOUR_PI_SQUARED = 4 * np.pi**2
