"""A real strip: from metres, newtons and pascals to dimensionless numbers and back.

           ________________________________  ← wall
      gap  ~~~~~~~~~ strip, thickness t ~~~~       its middle line has (gap − t)/2 to either side
           ________________________________  ← wall

With EI = E·width·thickness³/12 the unit of force is 4π²EI/L², that of energy and of end springs (N·m/rad)
4π²EI/L, that of lengths L, of curvature 1/L, and a frequency ω stands for ω/2π √(EI/ρA)/L² in hertz.
"""

import warnings
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from elastica.inputs import has_units, is_labelled, read_number, read_numbers, relabelled
from elastica.plausible import of_loading, of_strip
from elastica.scales import FOUR_PI_SQUARED

GIVEN = {"length": "m", "width": "m", "thickness": "m", "E": "Pa", "density": "kg/m**3"}
PHYSICAL = {"force": "N", "distance": "m", "energy": "J", "curvature": "1/m", "frequency": "Hz"}
"""What dimensionless numbers turn into, and its SI unit."""


@dataclass(frozen=True)
class Strip:
    """A uniform strip of rectangular section, which converts between physical and dimensionless values.

    Numbers are in SI units. Quantities of pint are accepted everywhere; once a strip is described by one,
    physical values are returned as quantities of the same registry.

    Parameters
    ----------
    length, width, thickness : float or pint quantity
        In metres; the walls are `thickness` away from the middle line's reach, see `to_dimensionless`.
    E : float or pint quantity
        Young's modulus in pascals. A strip much wider than thick bends as a plate: give E/(1 − ν²).
    density : float or pint quantity, optional
        In kg/m³; only frequencies need it.

    Raises
    ------
    ValueError
        If a number is not positive or a quantity is of another kind.

    Warns
    -----
    UserWarning
        If a size, the slenderness or the material is implausible, as of millimetres given as metres.

    Examples
    --------
    A steel ruler of 30 cm between walls 31 mm apart, pushed with 400 N:

    >>> import elastica
    >>> ruler = elastica.Strip(length=0.3, width=0.025, thickness=0.001, E=200e9, density=7850)
    >>> s = elastica.solve("U", **ruler.to_dimensionless(force=400.0, gap=0.031))
    >>> print(s.P.round(3), s.H.round(3), s.stability == elastica.Stability.STABLE)
    2.189 0.05 True
    >>> print(ruler.force(s.reaction).round(1), ruler.distance(s.shortening).round(5))
    [55.1] 0.00195
    >>> print(ruler.frequency(s.frequencies(1)).round(1), "Hz")
    [94.6] Hz
    """

    length: float
    width: float
    thickness: float
    E: float
    density: float | None = None
    _units: Any = field(default=None, init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        """Bring everything to SI and remember whose units were given."""
        for name, unit in GIVEN.items():
            given = getattr(self, name)
            if given is None and name == "density":
                continue
            if has_units(given):
                object.__setattr__(self, "_units", given._REGISTRY)
            value = read_number(name, given, unit)
            if not 0 < value < np.inf:
                raise ValueError(f"{name} = {given} cannot be; give one positive number, in {unit}")
            object.__setattr__(self, name, value)
        for doubt in of_strip(self):
            warnings.warn(doubt, stacklevel=3)

    @property
    def stiffness(self) -> float:
        """Bending stiffness EI in N·m²."""
        return self.E * self.width * self.thickness**3 / 12

    @property
    def scales(self) -> dict[str, float]:
        """What the dimensionless 1 of each of `PHYSICAL` is in SI units; no frequency without density."""
        EI, L = self.stiffness, self.length
        scales = {
            "force": FOUR_PI_SQUARED * EI / L**2,
            "distance": L,
            "energy": FOUR_PI_SQUARED * EI / L,
            "curvature": 1 / L,
        }
        if self.density is not None:
            mass = self.density * self.width * self.thickness
            scales["frequency"] = np.sqrt(EI / mass) / L**2 / (2 * np.pi)
        return scales

    def to_dimensionless(
        self, *, force: Any = None, gap: Any = None, shortening: Any = None
    ) -> dict[str, Any]:
        """What `elastica.solve` takes: ``solve("U", **strip.to_dimensionless(force=40.0, gap=0.02))``.

        Parameters
        ----------
        force : array_like or pint quantity, optional
            Thrust at the end, in newtons.
        gap : array_like or pint quantity, optional
            Distance between the walls, in metres. The middle line of the strip has gap − thickness of it.
        shortening : array_like or pint quantity, optional
            Approach of the ends, in metres.

        Returns
        -------
        dict
            `P`, `H` and `shortening`, those that were given.

        Raises
        ------
        ValueError
            If a quantity is of another kind, or a gap does not exceed the thickness.

        Warns
        -----
        UserWarning
            If no value of a kind can matter for this strip, or none is one that a strip can bear.
        """
        values: dict[str, Any] = {}
        if force is not None:
            values["P"] = _as_given(force, read_numbers("force", force, "N") / self.scales["force"])
        if gap is not None:
            free = read_numbers("gap", gap, "m") - self.thickness
            if np.any(free <= 0):
                raise ValueError(
                    f"gap = {gap} leaves no room for a strip {self.thickness:g} m thick; "
                    "give the distance between the walls"
                )
            values["H"] = _as_given(gap, free / (2 * self.length))
        if shortening is not None:
            nearer = read_numbers("shortening", shortening, "m")
            values["shortening"] = _as_given(shortening, nearer / self.length)
        for doubt in of_loading(self, **values):
            warnings.warn(doubt, stacklevel=2)
        return values

    def force(self, P: Any) -> Any:
        """Newtons, from a load P or a reaction."""
        return self._physical("force", P)

    def gap(self, H: Any) -> Any:
        """Distance between the walls in metres, the thickness of the strip included, from H."""
        return self._in_units(H, 2 * self.length * read_numbers("H", H) + self.thickness, "m")

    def distance(self, x: Any) -> Any:
        """Metres, from anything that is divided by L: x, y and s of a shape, shortening, flat length, …."""
        return self._physical("distance", x)

    def energy(self, U: Any) -> Any:
        """Joules, from an energy. For an end spring k the same number is N·m/rad."""
        return self._physical("energy", U)

    def curvature(self, kappa: Any) -> Any:
        """Curvature in 1/m; the strain at the surface is half the thickness times it."""
        return self._physical("curvature", kappa)

    def frequency(self, omega: Any) -> Any:
        """Hertz, from a natural frequency (`Solution.frequencies`); negative where motion grows.

        Raises
        ------
        ValueError
            If the strip has no density.
        """
        if self.density is None:
            raise ValueError("density = None: frequencies need it; give it to Strip in kg/m**3")
        return self._physical("frequency", omega)

    def _physical(self, name: str, values: Any) -> Any:
        return self._in_units(values, read_numbers(name, values) * self.scales[name], PHYSICAL[name])

    def _in_units(self, given: Any, values: np.ndarray, unit: str) -> Any:
        """Physical values as what was given: numbers, or a DataArray, with units if the strip has them."""
        answer = values if self._units is None else self._units.Quantity(values, unit)
        return relabelled(given, answer, unit) if is_labelled(given) else answer


def _as_given(given: Any, values: np.ndarray) -> Any:
    """Dimensionless values, as a DataArray if they were given as one."""
    return relabelled(given, values) if is_labelled(given) else values
