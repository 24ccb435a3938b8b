"""A chart says no more than was computed: where no state is, and of datasets joined or selected anew."""

import json

import numpy as np
import pytest
import xarray
from end_to_end.figures.panels import CC, SMALL, centres, curves, hatched, painted
from matplotlib.colors import to_rgb

import elastica
import studies
from elastica.paths.stable import stable_energy
from studies import Study
from studies.plot.style import NONE, colour


@pytest.mark.parametrize("show", ["stable", "preferred", "count"])
def test_some_state_is_always_stable_if_not_one_of_those_searched(dataset, coarse, show):
    figure = studies.plot.chart(dataset.isel(ends=[1]), show=show)
    hatches, labels = hatched(figure)
    assert "///" in hatches and "none of the states searched" in labels
    assert "search further by more names in [states]" in figure.get_supxlabel()
    everywhere = studies.plot.chart(dataset.isel(ends=[0], P=slice(0, 8)), show=show)
    assert hatched(everywhere)[0] == set() and "further" not in everywhere.get_supxlabel()
    asked = json.loads(dataset.attrs["config_json"]) | {"states": {"max_contacts": 2}}
    wider = dataset.isel(ends=[1]).assign_attrs(config_json=json.dumps(asked))
    assert "search further with max_contacts = 3" in studies.plot.chart(wider, show=show).get_supxlabel()


def test_where_states_hand_over_on_a_line_of_the_grid_some_state_is_shown(computed, coarse):
    """At P = 1 the straight strip is about to buckle, and nothing else exists."""
    content = SMALL | {"grid": {"ends": [CC], "H": [0.04, 0.08, 0.12], "P": [0.5, 1.0, 1.5, 2.0]}}
    with studies.open(computed(Study.from_dict(content))) as single:
        assert (single["stable_count"].sel(P=1.0) == 0).all()
        assert hatched(studies.plot.chart(single))[0] == set()
        # Also where the picture's own lines meet such a load.
        assert hatched(studies.plot.chart(single.sel(P=[0.5, 1.5, 2.0])))[0] == set()


def test_what_was_not_followed_is_hatched_and_named(computed, coarse):
    """Clamped, H = 0.19: U passes 90° at P = 7.655, and nobody looked further."""
    content = SMALL | {
        "grid": {"ends": [CC], "H": [0.18, 0.185, 0.19], "P": [1.0, 6.6, 7.0, 7.4, 7.8, 8.2]},
        "states": {"names": ["U"]},
    }
    with studies.open(computed(Study.from_dict(content))) as steep:
        steep = steep.load()
    gone = steep["status"] == elastica.Status.NO_EQUILIBRIUM
    steep["status"] = steep["status"].where(~gone | (steep["P"] < 7), elastica.Status.NOT_FOLLOWED)
    figure = studies.plot.chart(steep, show="max_slope", state="U")
    hatches, labels = hatched(figure)
    assert hatches == {"xxx"} and "not followed beyond 90°" in labels
    assert curves(figure.axes[0])["fold"][:, 1].max() < 6
    H, P = curves(figure.axes[0])["right angle, not followed beyond"].T
    assert np.interp(0.19, H[np.argsort(H)], P[np.argsort(H)]) == pytest.approx(7.655, abs=2e-3)
    # A piece of a curve begins where the one before it ends, which is another event.
    slope = elastica.solve("U", P=P, H=H).max_slope
    assert (np.abs(slope - np.pi / 2) < 1e-3).sum() == P.size - 1
    # In a chart of stable states only where none is stable.
    hatches, labels = hatched(studies.plot.chart(steep))
    assert "xxx" in hatches and "not followed beyond 90°" in labels


def test_next_to_where_following_ends_nothing_is_called_no_equilibrium(computed, coarse):
    """Clamped, H = 0.19: U passes 90° at P = 7.655, between two lines of the grid."""
    content = SMALL | {
        "grid": {"ends": [CC], "H": [0.18, 0.19, 0.2], "P": [6.6, 7.4, 8.2]},
        "states": {"names": ["U"]},
    }
    with studies.open(computed(Study.from_dict(content))) as steep:
        ax = studies.plot.chart(steep, show="max_slope", state="U").axes[0]
    white = np.ma.getmaskarray(ax.collections[0].get_array())
    (hatched_area,) = (area for area in ax.collections if getattr(area, "hatches", None))
    corners = ax.collections[0].get_coordinates()
    H, P = np.meshgrid(centres(corners[..., 0], 0), centres(corners[..., 1], 1))
    status = elastica.solve("U", P=P[white], H=H[white]).status
    assert (status == elastica.Status.NOT_FOLLOWED).all() and status.size
    inside = [
        any(path.contains_point(at) for path in hatched_area.get_paths())
        for at in zip(H[white], P[white], strict=True)
    ]
    assert np.mean(inside) > 0.9, np.mean(inside)


@pytest.mark.parametrize("show", ["stable", "preferred", "count"])
def test_the_order_of_labels_changes_no_picture(dataset, coarse, show):
    """Reversed, shuffled, reindexed with a state that is nowhere, joined again from pieces, chosen anew."""
    dataset, names = dataset.isel(ends=[0]), SMALL["states"]["names"]
    expected = painted(studies.plot.chart(dataset, show=show))
    pieces = [dataset.isel(H=slice(3, None)), dataset.isel(H=slice(0, 3))]
    changed = {
        "sel": dataset.sel(state=names[::-1]),
        "isel": dataset.isel(H=[3, 1, 0, 4, 2], P=slice(None, None, -1)),
        "concat": xarray.concat(pieces, "H"),
        "reindex": dataset.reindex(state=["UUU", *names]),
        "where": dataset.where(dataset["H"] > 0),
    }
    for how, other in changed.items():
        before = other.copy(deep=True)
        assert np.array_equal(painted(studies.plot.chart(other, show=show)), expected), how
        xarray.testing.assert_identical(other, before)


@pytest.mark.parametrize("gone", [["0"], ["U"], ["U-", "UD"]])
def test_the_preferred_state_is_one_of_those_there(dataset, coarse, gone):
    """As if the others had never been computed."""
    left = dataset.isel(ends=[0]).drop_sel(state=gone)
    figure = studies.plot.chart(left, show="preferred")
    H, P = (centres(figure.axes[0].collections[0].get_coordinates()[..., axis], axis) for axis in (0, 1))
    names, seen = [str(name) for name in left["state"].values], painted(figure)
    # Above the buckling load of the straight strip, away from the curves.
    for j, i in np.random.default_rng(7).integers((6, 0), (P.size, H.size), (40, 2)):
        energies = [stable_energy(name, P[j : j + 1], H[i : i + 1])[0] for name in names]
        shade = colour(names[np.nanargmin(energies)]) if np.isfinite(energies).any() else NONE
        assert np.allclose(seen[j, i], to_rgb(shade)), (P[j], H[i], energies)


def test_joined_outputs_with_other_states_show_what_was_computed(dataset, coarse):
    """Where a file says nothing of a state the chart does not either."""
    first, second = dataset.isel(H=slice(0, 2)).drop_sel(state="UD"), dataset.isel(H=slice(2, None))
    both = xarray.concat([first, second], "H", join="outer")
    assert both["status"].dtype.kind == "f"
    figure = studies.plot.chart(both, show="preferred")
    assert "only in part: UD" in figure.get_supxlabel()
    expected = painted(studies.plot.chart(dataset, show="preferred"))
    # The grid is 9 wide, and 4 of it nearer to the gaps of the first.
    assert np.array_equal(painted(figure)[:, 4:], expected[:, 4:])
    assert not np.isclose(painted(figure)[:, :3], to_rgb(colour("UD"))).all(axis=-1).any()
    for line in figure.axes[0].get_lines():
        H, P = line.get_data()
        assert np.ptp(H) > 0 or np.ptp(P) < 0.1, "no event ends what was not computed"


def test_at_given_shortening_nothing_is_solved_again(computed, monkeypatch):
    content = {
        "study": {"name": "held"},
        "grid": {"ends": [CC], "H": [0.05, 0.1], "shortening": [0.01, 0.02, 0.03, 0.04, 0.05]},
        "states": {"names": ["B1", "U", "Ua"]},
    }
    with studies.open(computed(Study.from_dict(content))) as held:
        chart = studies.plot.chart(held)
        assert "nearest grid point" in chart.get_supxlabel()
        assert not chart.axes[0].get_lines()
        mesh = chart.axes[0].collections[0]
        H, given = (centres(mesh.get_coordinates()[..., axis], axis) for axis in (0, 1))
        stable = ((held["stability"] == 0) & (held["status"] == 0)).isel(ends=0)
        for h, s in ((0.06, 0.021), (0.09, 0.039)):
            near = stable.sel(H=h, shortening=s, method="nearest")
            shades = [to_rgb(colour(str(name))) for name in near["state"].values[near.values]] or [
                to_rgb(NONE)
            ]
            seen = mesh.get_array()[np.abs(given - s).argmin(), np.abs(H - h).argmin()]
            assert any(np.allclose(seen, shade) for shade in shades)
        diagram = studies.plot.bifurcation(held, H=0.1)
        assert any(line.get_label() == "U" for line in diagram.axes[0].get_lines())
