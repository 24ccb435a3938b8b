"""End conditions: how each end of the strip is held, from names such as "clamped-pinned" or "0.3/2.5"."""

import math
import re
from typing import NamedTuple

from elastica.scales import FOUR_PI_SQUARED
from elastica.spelling import did_you_mean, meant, shown

DIGITS = 12
"""Significant digits of a spring in names: labels of the same spring compare equal."""
SOFTEST, STIFFEST = 1e-12, 1e12
"""Springs beyond act as a pin or a clamp to ten digits; by 1e30 numbers of double precision fail."""
ALLOWED = (
    'write "A-B" or "A/B" with each side clamped, pinned or a spring constant k >= 0, such as '
    '"clamped-pinned", "0.3/2.5" or "clamped/2.5"'
)


class End(NamedTuple):
    """One end of the strip, held by a spiral spring: k = 0 is pinned, k = inf is clamped.

    The constant is dimensionless, k = k* L/(4π²EI).
    """

    k: float

    @property
    def clamped(self):
        """Whether the angle is held."""
        return math.isinf(self.k)

    @property
    def pinned(self):
        """Whether the angle is free."""
        return self.k == 0

    @property
    def stiffness(self):
        """Spring constant c = 4π²k with EI = L = 1."""
        return FOUR_PI_SQUARED * self.k

    def __str__(self):
        """Write the end as `parse_ends` reads it."""
        return "clamped" if self.clamped else "pinned" if self.pinned else f"{self.k:.{DIGITS}g}"


CLAMPED, PINNED = End(math.inf), End(0.0)
NAMED = {"clamped": CLAMPED, "pinned": PINNED}
IN_WORDS = {"fixed": "clamped", "hinged": "pinned", "simple": "pinned", "supported": "pinned"}
"""What some would call an end, by what is asked whether they mean it."""


class Ends(NamedTuple):
    """End A (fixed, s = 0) and end B (sliding, s = 1)."""

    A: End
    B: End

    @property
    def alike(self):
        """Whether the strip looks the same from both ends."""
        return self.A == self.B

    def __str__(self):
        """Write `A-B`, or `A/B` where there is a spring: the forms that `parse_ends` reads."""
        springs = any(not (end.clamped or end.pinned) for end in self)
        return f"{self.A}{'/' if springs else '-'}{self.B}"


def parse_ends(text):
    """Read an end condition `A-B` or `A/B`.

    Parameters
    ----------
    text : str or Ends

    Returns
    -------
    Ends

    Raises
    ------
    ValueError
        If the text names no end condition, or a spring is not 0 and beyond 1e-12 to 1e12; the message
        says what is allowed.
    """
    if isinstance(text, Ends):
        return text
    cuts = re.finditer("/" if "/" in text else "-", text) if isinstance(text, str) else ()
    for cut in cuts:
        a, b = (_parse_end(part.strip()) for part in (text[: cut.start()], text[cut.end() :]))
        if a is not None and b is not None:
            return _resolved(Ends(a, b), text)
    raise ValueError(f"ends = {shown(text)} is not known{_question(text)}; {ALLOWED}")


def _resolved(ends, text):
    """Ends whose springs are not so soft or stiff that numbers cannot tell them from pins or clamps."""
    for end in ends:
        if not (end.pinned or end.clamped or SOFTEST <= end.k <= STIFFEST):
            limit, like = (STIFFEST, "clamped") if end.k > 1 else (SOFTEST, "pinned")
            raise ValueError(
                f"ends = {shown(text)}: a spring {'above' if end.k > 1 else 'below'} {limit:g} is, to ten "
                f"digits, the same as {like}; write {like}"
            )
    return ends


def _question(text):
    """Which ends were meant by a text that names none; one alone stands for both."""
    parts = re.split(r"[-−–—/,\s]+", text.strip()) if isinstance(text, str) else []
    likely = [part if _parse_end(part) else meant(IN_WORDS.get(part, part), NAMED) for part in parts]
    known = [part for part in likely if part is not None]
    if len(known) < len(parts) or len(parts) not in (1, 2):
        return ""
    spelled = str(parse_ends("/".join(known * (3 - len(known)))))
    return did_you_mean(spelled, [spelled])


def _parse_end(text):
    """The end that a word or a number stands for, None where there is none."""
    named = NAMED.get(text)
    if named is not None:
        return named
    try:
        k = float(f"{float(text):.{DIGITS}g}")
    except ValueError:
        return None
    return End(k) if k >= 0 else None
