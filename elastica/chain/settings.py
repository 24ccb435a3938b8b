"""The two settings of a chain: how it touches the wall, and what its energy method lets move there.

Each is a module with the functions of `Setting`. Which one is taken is chosen once, by `clamp`; nothing else
asks.
"""

from typing import Protocol

import numpy as np

from elastica.chain import consistent, published
from elastica.chain.bordered import QuadraticForm
from elastica.chain.equilibrium import Equilibrium
from elastica.control import LOAD, Control


class Setting(Protocol):
    """What the settings do each in its way; a state is one that the setting has `settled`."""

    MOST_CONTACTS: float

    def settled(self, state: Equilibrium, shortening: float | None = None) -> Equilibrium:
        """The equilibrium of this setting nearest to that of a chain with cut links.

        At the shortening, if one is given, otherwise under the same thrust. Raises NoEquilibrium.
        """

    def second_variation(
        self, state: Equilibrium, contacts_move: bool = True, control: Control = LOAD
    ) -> QuadraticForm:
        """The second variation, with contacts that move, or held at their material points (conventional)."""

    def contact_curvatures(self, state: Equilibrium) -> np.ndarray:
        """θ' at each point contact, negative where the strip bends away from the upper wall, (contacts,)."""

    def truncation(self, state: Equilibrium) -> float:
        """By how much eigenvalues differ from those of the strip."""

    def resolves_contacts(self, state: Equilibrium) -> bool:
        """Whether the curvature at point contacts can be told from zero."""


SETTINGS: dict[str, Setting] = {"consistent": consistent, "published": published}
