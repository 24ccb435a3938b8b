"""What is prescribed of the strip: the load, or the approach of its ends."""

from typing import NamedTuple


class Control(NamedTuple):
    """A quantity that is prescribed, and what follows from holding it.

    Attributes
    ----------
    name : str
        Of the quantity: "P" or "shortening".
    potential : str
        What a stable state makes least: with fixed ends the load does no work.
    fixes_shortening : bool
        Whether a variation keeps the shortening, ∫ sin θ φ ds = 0 to first order.
    """

    name: str
    potential: str
    fixes_shortening: bool


LOAD = Control("P", "energy", False)
SHORTENING = Control("shortening", "bending_energy", True)
CONTROLS = {control.name: control for control in (LOAD, SHORTENING)}


def read_control(P, shortening):
    """Which of the two is prescribed, and its values.

    Raises
    ------
    ValueError
        If not exactly one is given.
    """
    if (P is None) == (shortening is None):
        raise ValueError("give either P or shortening: one is prescribed, the other follows")
    return (LOAD, P) if shortening is None else (SHORTENING, shortening)
