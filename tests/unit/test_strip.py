import re
import warnings

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
        elastica.Strip(length=1, width=0.1, thickness=0.01, E=1e9).frequency(1.0)
    for values, kind in (("x", "text"), (3 * ureg.N, "in newton")):
        with pytest.raises(ValueError, match=f"force = .* is {kind}; give dimensionless numbers"):
            ruler.force(values)


PLAUSIBLE = {
    "steel ruler": (RULER, {"force": 400.0, "gap": 0.031}),
    "sheet of paper": (
        {"length": 0.297, "width": 0.21, "thickness": 1e-4, "E": 3e9, "density": 800},
        {"force": 0.02, "gap": 0.02},
    ),
    "steel tape": ({"length": 10.0, "width": 0.013, "thickness": 1e-4, "E": 2e11}, {"gap": 0.05}),
    "rubber": ({"length": 0.1, "width": 0.02, "thickness": 0.003, "E": 1e6, "density": 1100}, {"force": 0.1}),
    "drill pipe": (
        {"length": 2000.0, "width": 0.127, "thickness": 0.127, "E": 2e11},
        {"force": 5e4, "gap": 0.3},
    ),
    "silicon beam": (
        {"length": 1e-5, "width": 2e-7, "thickness": 1e-7, "E": 1.69e11, "density": 2329},
        {"force": 1e-6, "gap": 3e-7, "shortening": 1e-7},
    ),
    "graphene": ({"length": 1e-5, "width": 1e-6, "thickness": 3.4e-10, "E": 1e12}, {"gap": 1e-6}),
    "a sweep from nothing": (RULER, {"force": [0.0, 1.0, 400.0], "gap": [0.0011, 0.5]}),
}


@pytest.mark.parametrize("name", PLAUSIBLE)
def test_real_strips_raise_no_doubt(name):
    dimensions, loading = PLAUSIBLE[name]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        elastica.Strip(**dimensions).to_dimensionless(**loading)


@pytest.mark.parametrize(
    ("change", "doubts"),
    [
        ({"length": 300, "width": 25, "thickness": 1}, ["width = 25 m", "thickness = 1 m"]),
        (
            {"length": 300.0, "thickness": 1.0},
            ["thickness = 1 m", "width = 0.025 m is below thickness = 1 m"],
        ),
        ({"thickness": 0.05, "width": 0.06}, ["thickness = 0.05 m is 0.17 of length = 0.3 m"]),
        ({"thickness": 1e-8, "length": 1.0}, ["thickness = 1e-08 m is 1e-08 of length = 1 m"]),
        ({"width": 0.001, "thickness": 0.025}, ["width = 0.001 m is below thickness = 0.025 m"]),
        ({"E": 200}, ["E = 200 Pa"]),
        ({"E": 20}, ["E = 20 Pa"]),
        ({"E": 200e12}, [r"E = 2e\+14 Pa"]),
        ({"density": 7.85}, [r"density = 7.85 kg/m\*\*3"]),
        ({"density": 7.85e6}, [r"density = 7.85e\+06 kg/m\*\*3"]),
    ],
)
def test_an_implausible_strip_is_doubted_with_the_number_that_looks_wrong(change, doubts):
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        elastica.Strip(**RULER | change)
    assert len(told) == len(doubts) and all(doubt.filename == __file__ for doubt in told)
    for doubt, pattern in zip(told, doubts, strict=True):
        assert re.match(f"{pattern}.* check ", str(doubt.message)), doubt.message


@pytest.mark.parametrize(
    ("loading", "doubt"),
    [
        ({"force": 0.5}, "force = 0.5 N is P = 0.0027, and no strip buckles below P = 0.25"),
        ({"force": [0.0, -1.0, 2.0]}, "force = 2 N is P = 0.011"),
        ({"force": 4e5}, r"force = 4e\+05 N is P = .* shortens the strip by 8 %"),
        ({"gap": 31.0}, "gap = 31 m is wider than length = 0.3 m"),
        ({"gap": 0.001 + 1e-9}, "gap = 0.001000001 m leaves 1e-09 m"),
        ({"shortening": 6.0}, "shortening = 6 m is more than length = 0.3 m"),
        ({"shortening": 1e-7}, "shortening = 1e-07 m is less than what compresses the strip"),
    ],
)
def test_loads_that_cannot_matter_are_doubted(ruler, loading, doubt):
    with pytest.warns(UserWarning, match=f"^{doubt}") as told:
        ruler.to_dimensionless(**loading)
    assert len(told) == 1 and told[0].filename == __file__


def test_millimetres_for_metres_are_never_silent():
    with pytest.warns(UserWarning, match="check that it is in metres"):
        strip = elastica.Strip(length=300, width=25, thickness=1, E=200e9)
    with pytest.warns(UserWarning, match=r"is P = 2\.7e-06"):
        strip.to_dimensionless(force=500, gap=31)
