"""Charts contain what they claim: curves at the right loads, regions with the colours of their states."""

from itertools import pairwise

import numpy as np
import pytest
from end_to_end.figures.panels import CC, PP, SMALL, centres, curves, legend
from matplotlib.colors import to_hex, to_rgb
from references.onsets import loads

import elastica
import studies
from elastica.paths.stable import stable_energy
from studies import Study
from studies.plot.style import COLOURS, NONE, OTHERS, colour


@pytest.mark.parametrize(
    ("panel", "label", "event"),
    [
        (0, "straight strip buckles", "buckles"),
        (0, "point becomes line", "point_to_line"),
        (1, "point becomes line", "point_to_line"),
        (1, "flat stretch buckles", "flat_buckles"),
    ],
)
def test_curves_of_a_chart_lie_at_the_exact_loads(chart, panel, label, event):
    H, P = curves(chart.axes[panel])[label].T
    exact = loads(event, H, (CC, PP)[panel])
    own = np.abs(P / exact - 1) < 0.2
    assert own.sum() > 50
    # Along the grid lines of constant H the load is sought, along the others the gap.
    assert np.abs(P[own] / exact[own] - 1).max() < 1e-6


def test_a_curve_that_bounds_two_states_is_drawn_once(chart):
    """Pinned, the point that becomes a line is the end of U and the beginning of U-."""
    H, P = curves(chart.axes[1])["point becomes line"].T
    low = P < 1.1
    assert np.unique(H[low]).size > 0.8 * low.sum()


def test_regions_end_at_the_curves(chart):
    """Every point of the picture has the colour of what is stable there, also between the grid points."""
    mesh = chart.axes[0].collections[0]
    H, P = (centres(mesh.get_coordinates()[..., axis], axis) for axis in (0, 1))
    pick = np.random.default_rng(4)
    rows, columns = pick.integers(0, P.size, 60), pick.integers(0, H.size, 60)
    near = np.abs(P[rows] - 1.01) < 0.1
    seen = mesh.get_array()[rows, columns]
    for at in np.flatnonzero(~near):
        place = {"P": np.array([P[rows[at]]]), "H": np.array([H[columns[at]]])}
        names = [
            str(name)
            for name in SMALL["states"]["names"]
            if np.isfinite(stable_energy(name, **place, ends=CC))[0]
        ]
        allowed = [to_rgb(colour(name)) for name in names] or [to_rgb(NONE)]
        assert any(np.allclose(seen[at], shade) for shade in allowed), (place, names)


def test_a_zone_thinner_than_the_grid_is_found(chart):
    """B1 is stable between its Euler load and the wall, less than a step of the grid apart."""
    mesh = chart.axes[0].collections[0]
    painted = mesh.get_array().reshape(-1, 3)
    assert np.isclose(painted, to_rgb(colour("B1"))).all(axis=1).any()
    assert "B1" in {text.get_text() for text in chart.legends[0].get_texts()}


def test_preferred_states_meet_at_equal_energy(dataset):
    figure = studies.plot.chart(dataset.isel(ends=[0]), show="preferred")
    H, P = curves(figure.axes[0])["equal energy"].T
    energies = [stable_energy(name, P, H) for name in ("U", "UD")]
    assert np.nanmax(np.abs(energies[0] / energies[1] - 1)) < 1e-6


def test_every_border_of_preferred_states_is_named_after_its_event(dataset, coarse):
    """Pinned, U- is stable below and above the load at which UD becomes a line, at far more energy."""
    figure = studies.plot.chart(dataset.isel(ends=[1]), show="preferred")
    drawn = curves(figure.axes[0])
    H, P = drawn["point becomes line"].T
    # Above lies the load at which the flat stretch of U- buckles, where a piece of curve may begin.
    upper = (P > 2) & (P < 3.8) & (np.abs(H - 0.1) < 0.02)
    assert upper.sum() > 4 and np.interp(0.1, H[upper], P[upper]) == pytest.approx(3.7176, abs=0.01)
    assert np.isfinite(stable_energy("UD", P[upper] * 0.999, H[upper], PP)).all()
    assert np.isnan(stable_energy("UD", P[upper] * 1.001, H[upper], PP)).all()
    H, P = drawn["equal energy"].T
    energies = [stable_energy(name, P, H, PP) for name in ("U-", "UD")]
    assert P.max() < 2 and np.abs(energies[0] / energies[1] - 1).max() < 1e-6


def test_counts_and_variables_are_drawn(dataset):
    dataset = dataset.isel(ends=[0])
    counted = studies.plot.chart(dataset, show="count").axes[0].collections[0].get_array()
    assert counted.max() == 2
    figure = studies.plot.chart(dataset, show="shortening", state="U")
    values = figure.axes[0].collections[0].get_array()
    stored = dataset["shortening"].sel(state="U").where(dataset["status"].sel(state="U") == 0)
    assert values.max() == pytest.approx(float(stored.max()), rel=1e-9)


def test_verdicts_of_one_state_change_at_the_exact_loads(computed, coarse):
    """Pinned, the flat stretch of U- buckles between two lines of the grid."""
    content = SMALL | {
        "grid": {"ends": [PP], "H": [0.06, 0.09, 0.12], "P": [1.5, 2.5, 3.5, 4.5]},
        "states": {"names": ["U-"]},
    }
    with studies.open(computed(Study.from_dict(content))) as lines:
        for show in ("index", "stability"):
            ax = studies.plot.chart(lines, show=show, state="U-").axes[0]
            H, P = curves(ax)["flat stretch buckles"].T
            assert H.min() == 0.06 and H.max() == 0.12 and P.min() > 3.6
            assert (elastica.solve("U-", P=P * 0.999, H=H, ends=PP).index == 0).all()
            assert (elastica.solve("U-", P=P * 1.001, H=H, ends=PP).index == 1).all()
            mesh = ax.collections[0]
            corners = mesh.get_coordinates()
            H, P = np.meshgrid(centres(corners[..., 0], 0), centres(corners[..., 1], 1))
            exact = getattr(elastica.solve("U-", P=P, H=H, ends=PP), show)
            assert (mesh.get_array() == exact).mean() > 0.97
        caption = studies.plot.chart(lines, show="status", state="U-").get_supxlabel()
        assert "white" not in caption and "nearest grid point" in caption


def test_a_state_keeps_its_colour(chart, dataset):
    handles = {text.get_text(): patch for text, patch in legend(chart)}
    for name in ("0", "U", "U-", "UD"):
        assert to_hex(handles[name].get_facecolor()) == COLOURS[name]
    diagram = studies.plot.bifurcation(dataset, H=0.06)
    drawn = {line.get_label(): line.get_color() for line in diagram.axes[0].get_lines()}
    assert drawn["U"] == COLOURS["U"]
    assert colour("UDUDa") in OTHERS
    assert colour("UD:3") == colour("UD")


def test_neighbouring_colours_differ_in_grey():
    def grey(name):
        return np.dot(to_rgb(COLOURS[name]), (0.299, 0.587, 0.114))

    for sequence in (("0", "B1", "U", "U-"), ("U", "UD"), ("U-", "UD-"), ("UD", "UDU")):
        for one, other in pairwise(sequence):
            assert abs(grey(one) - grey(other)) > 0.12, (one, other)


def test_points_that_were_not_computed_take_the_nearest(dataset, chart):
    thinned = dataset.isel(ends=[0]).copy(deep=True)
    thinned["status"][:, :, 5::7] = -1
    whole = chart.axes[0].collections[0].get_array()
    holes = studies.plot.chart(thinned).axes[0].collections[0].get_array()
    assert np.isclose(whole, holes).all(axis=-1).mean() > 0.97
