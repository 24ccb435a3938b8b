import numpy as np
import pint
import pytest

import elastica

RULER = {"length": 0.3, "width": 0.025, "thickness": 0.001, "E": 200e9, "density": 7850}
EI = 200e9 * 0.025 * 0.001**3 / 12


@pytest.fixture
def ruler():
    return elastica.Strip(**RULER)


@pytest.fixture(scope="module")
def ureg():
    return pint.UnitRegistry()


def test_euler_loads_are_those_of_the_handbook(ruler):
    # Clamped π²EI/(L/2)², pinned π²EI/L².
    assert ruler.force(1.0) == pytest.approx(np.pi**2 * EI / 0.15**2, rel=1e-14)
    assert ruler.force(0.25) == pytest.approx(np.pi**2 * EI / 0.3**2, rel=1e-14)
    assert ruler.to_dimensionless(force=ruler.force([0.25, 1.0]))["P"] == pytest.approx([0.25, 1.0])


def test_the_gap_counts_the_thickness(ruler):
    given = ruler.to_dimensionless(gap=0.031, shortening=0.006)
    assert given == {"H": pytest.approx(0.05), "shortening": pytest.approx(0.02)}
    assert ruler.gap(0.05) == pytest.approx(0.031)


def test_work_of_the_force_is_the_change_of_energy(ruler):
    # dU/dP = −ΔL in physical units: joules = newtons × metres.
    s = elastica.solve("U", P=[2.5 - 1e-5, 2.5, 2.5 + 1e-5], H=0.05)
    energy, force = ruler.energy(s.energy), ruler.force(s.P)
    slope = (energy[2] - energy[0]) / (force[2] - force[0])
    assert slope == pytest.approx(-ruler.distance(s.shortening)[1], rel=1e-6)


def test_a_pinned_beam_vibrates_as_in_the_handbook(ruler):
    # f₁ = (π/2L²) √(EI/ρA)
    omega = elastica.solve("0", P=0.0, H=0.1, ends="pinned-pinned").frequencies(1)
    assert ruler.frequency(omega)[0] == pytest.approx(
        np.pi / (2 * 0.3**2) * np.sqrt(EI / (7850 * 0.025 * 0.001)), rel=1e-9
    )


def test_curvature_gives_the_strain(ruler):
    # A ring of radius L has κ = 1.
    assert ruler.curvature(1.0) == pytest.approx(1 / 0.3)


def test_quantities_come_in_and_go_out(ruler, ureg):
    strip = elastica.Strip(
        length=30 * ureg.cm, width=25 * ureg.mm, thickness=1 * ureg.mm, E=200 * ureg.GPa, density=7850
    )
    assert strip == ruler
    given = strip.to_dimensionless(force=np.array([0.04, 0.05]) * ureg.kN, gap=31 * ureg.mm)
    assert given["P"] == pytest.approx(ruler.to_dimensionless(force=[40.0, 50.0])["P"])
    assert given["H"] == pytest.approx(0.05)
    assert strip.force(1.0).to("kN").magnitude == pytest.approx(ruler.force(1.0) / 1000)
    assert strip.energy(1.0).check("[energy]") and strip.frequency(1.0).check("1/[time]")
    assert strip.gap(0.05).to("mm").magnitude == pytest.approx(31)
    assert strip.distance(np.zeros((2, 3))).shape == (2, 3)


def test_what_makes_no_sense_is_one_sentence(ruler, ureg):
    for change, message in (
        ({"length": -1.0}, r"length = -1\.0 cannot be; give one positive number, in m"),
        ({"E": float("nan")}, "E = nan cannot be"),
        ({"width": [1.0, 2.0]}, r"width = \[1.0, 2.0\] has the shape \(2,\); give one number in m"),
        ({"thickness": "thin"}, "thickness = 'thin' is text; give numbers in m"),
        ({"length": 3 * ureg.kg}, "length = 3 kilogram is in kilogram; give numbers in m"),
    ):
        with pytest.raises(ValueError, match=message):
            elastica.Strip(**RULER | change)
    with pytest.raises(ValueError, match=r"gap = 0\.001 leaves no room for a strip 0\.001 m thick"):
        ruler.to_dimensionless(gap=0.001)
    with pytest.raises(ValueError, match=r"force = 1 meter is in meter; give numbers in N"):
        ruler.to_dimensionless(force=1 * ureg.m)
    with pytest.raises(ValueError, match="density = None: frequencies need it"):
        elastica.Strip(length=1, width=1, thickness=1, E=1).frequency(1.0)
    for values, kind in (("x", "text"), (3 * ureg.N, "in newton")):
        with pytest.raises(ValueError, match=f"force = .* is {kind}; give dimensionless numbers"):
            ruler.force(values)
