"""Equilibria at 50 digits by Newton's method, and the numbers that are compared with them."""

from mpmath import matrix as vector
from mpmath import mp, mpf
from references.make_states import _newton, measure

TOLERANCE = mpf(10) ** -38


def strain(kind, kappa, lam, p):
    """Bending energy ½∫θ'² and shortening of a segment, from its first integral."""
    length, rise, advance = measure(kind, kappa, lam, p)
    return p * advance + lam * rise + (kappa**2 / 2 - p) * length, length - advance


def values(kinds, kappa, lams, p):
    """What is compared: curvature, energy, lengths of the first and second segment, flat length."""
    bent = [strain(kind, kappa, lam, p) for kind, lam in zip(kinds, lams, strict=True)]
    energy = sum(b - p * s for b, s in bent) / (4 * mp.pi**2)
    lengths = [measure(kind, kappa, lam, p)[0] for kind, lam in zip(kinds, lams, strict=True)]
    return {"kappa": kappa, "energy": energy, "lengths": lengths}


def point(kinds, rises, p, kappa, lams):
    """κ and λ of each distinct kind of a point state, or of a free one, from a start."""
    distinct = list(dict.fromkeys(zip(kinds, rises, strict=True)))

    def residual(kappa, *lams):
        found = [measure(kind, kappa, lam, p) for (kind, _), lam in zip(distinct, lams, strict=True)]
        total = sum(found[distinct.index(pair)][0] for pair in zip(kinds, rises, strict=True))
        return [total - 1] + [part[1] - pair[1] for part, pair in zip(found, distinct, strict=True)]

    kappa, *lams = _newton(residual, vector([kappa, *lams]), TOLERANCE)
    if kappa < 0:
        raise ArithmeticError("negative curvature")
    return kappa, [lams[distinct.index(pair)] for pair in zip(kinds, rises, strict=True)]
