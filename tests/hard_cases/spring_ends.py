"""Contact states between equal springs from 1e-12 to 1e12: from pinned to clamped, at 50 digits.

A spring c holds an end at the phase φ₁ of the pendulum where its moment cθ is the strip's, κ₀ = cθ₀ (theory
of any end to a wall): one more equation beside the rise and the length.
"""

from hard_cases.equilibria import TOLERANCE, point
from hard_cases.line_states import line_force
from hard_cases.one_contact import linear_start
from hard_cases.records import CC, PP, case, thrust
from mpmath import matrix as vector
from mpmath import mp, mpf
from references.make_states import Kind, _newton

FOLLOWED = (
    ("U", PP, 0.9, 0.1),
    ("U", CC, 2.0, 0.05),
    ("U-", PP, 5.0, 0.1),
    ("U-", PP, 3.0, 0.01),
    ("U-", PP, 10.0, 0.05),
)
"""State, ends from which it is followed, P and H."""
STEPS = 4
"""Steps to a decade."""


def held(kappa, lam, phi, c, p):
    """Length, rise, advance, moment that is missing at the spring, and angle there, of a segment S."""
    force = mp.hypot(p, lam)
    alpha, r = mp.atan2(lam, p), mp.sqrt(force)
    half = mp.sin(alpha / 2)
    m = kappa**2 / (4 * force) + half**2
    phase = mp.atan2(2 * r * half, kappa)
    theta = alpha + 2 * mp.asin(mp.sqrt(m) * mp.sin(phi))
    moment = 2 * r * mp.sqrt(m) * mp.cos(phi)
    length = (2 * mp.ellipk(m) + mp.ellipf(phase, m) - mp.ellipf(phi, m)) / r
    along = 2 * (2 * mp.ellipe(m) + mp.ellipe(phase, m) - mp.ellipe(phi, m)) / r - length
    rise = mp.cos(alpha) * (kappa + moment) / force + mp.sin(alpha) * along
    advance = mp.cos(alpha) * along - mp.sin(alpha) * (kappa + moment) / force
    return length, rise, advance, (moment - c * theta) / max(mpf(1), c), theta


def state(k, P, H, start, line=False):
    """κ (0 for a line), λ and φ₁ of the symmetric one-contact state, from a start."""
    p, c = thrust(P), 4 * mp.pi**2 * mpf(k)

    def residual(kappa, lam, phi):
        length, rise, _, missing, _ = held(mpf(0) if line else kappa, lam, phi, c, p)
        return [kappa if line else 2 * length - 1, rise - mpf(H), missing]

    return _newton(residual, vector(start), TOLERANCE)


def numbers(k, P, H, kappa, lam, phi):
    """What is compared; the energy includes that of the springs."""
    p, c = thrust(P), 4 * mp.pi**2 * mpf(k)
    length, rise, advance, _, theta = held(kappa, lam, phi, c, p)
    # ½θ'² = F cos ψ + const with κ at the wall.
    bent = p * advance + lam * rise + (kappa**2 / 2 - p) * length + c * theta**2 / 2
    energy = 2 * (bent - p * (length - advance)) / (4 * mp.pi**2)
    return {"kappa": kappa, "energy": energy, "lengths": [length, length], "flat": 1 - 2 * length}


def spring_contacts():
    """A point contact, a line, and a buckled flat stretch, followed along the stiffness of the springs.

    Between springs of any finite stiffness a line state is a minimum until its flat stretch buckles. It is
    followed from the pinned strip: at a clamp it meets the one whose ends bend away first.
    """
    for name, ends, P, H in FOLLOWED:
        line, found = name == "U-", _first(name, ends, P, H)
        for step in range(24 * STEPS + 1):
            exponent = (12 - step / STEPS) * (1 if ends == CC else -1)
            k = 10.0**exponent
            found = state(k, P, H, found, line)
            record = numbers(k, P, H, *found)
            if min(found[0], found[1]) < 0 or record["flat"] < -(mpf(10) ** -40):
                break
            if step % STEPS:
                continue
            buckled = line and record["flat"] * mp.sqrt(thrust(P)) > 2 * mp.pi
            verdict = ("unstable", 1) if buckled else ("stable", 0)
            yield case("springs", name, f"{k!r}/{k!r}", P, H, "solved", *verdict, **record)


def _first(name, ends, P, H):
    """κ, λ and φ₁ of the state between clamps or pins."""
    p, kind = thrust(P), Kind("clamped" if ends == CC else "pinned", "S")
    if name == "U-":
        kappa, lam = mpf(0), p * mp.tan(line_force(mpf(H) * mp.sqrt(mpf(P)) * (1 if ends == CC else 2)))
    else:
        kappa, lam = linear_start(ends, P, H)
        kappa, (lam, _) = point([kind] * 2, [mpf(H)] * 2, p, kappa, [lam])
    half = mp.sin(mp.atan2(lam, p) / 2)
    phase = mp.atan2(2 * mp.sqrt(mp.hypot(p, lam)) * half, kappa)
    return kappa, lam, -phase if ends == CC else mp.pi / 2
