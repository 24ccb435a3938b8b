"""Figures contain what they claim: curves and arrows at the right loads, colours by state, reactions."""

import errno
import json
import os
import shutil
from itertools import pairwise
from pathlib import Path

import matplotlib
import numpy as np
import pytest
import xarray
from click.testing import CliRunner
from matplotlib.colors import to_hex, to_rgb
from matplotlib.testing.compare import compare_images
from references.onsets import loads

import elastica
import studies
from elastica.paths.stable import stable_energy
from studies import Study, StudyError
from studies.command_line import main
from studies.plot.branches import branches, jumps
from studies.plot.shapes import Configuration, draw
from studies.plot.style import COLOURS, NONE, OTHERS, colour

CC, PP = "clamped-clamped", "pinned-pinned"
BASELINES = Path(__file__).parents[1] / "figures"
SMALL = {
    "study": {"name": "figures"},
    "grid": {
        "ends": [CC, PP],
        "H": {"start": 0.04, "stop": 0.12, "num": 5},
        "P": {"start": 0.2, "stop": 6.0, "num": 15},
    },
    "states": {"names": ["0", "B1", "U", "Ua", "U-", "UD"]},
}


@pytest.fixture(scope="module")
def file(computed):
    return computed(Study.from_dict(SMALL))


@pytest.fixture(scope="module")
def dataset(file):
    with studies.open(file) as opened:
        yield opened.load()


@pytest.fixture(scope="module")
def chart(dataset):
    return studies.plot.chart(dataset)


def curves(ax):
    """H and P of all curves of a panel, by their labels."""
    found = {}
    for line in ax.get_lines():
        found.setdefault(line.get_label(), []).append(line.get_xydata())
    return {label: np.concatenate(parts) for label, parts in found.items()}


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


def centres(edges, axis):
    edges = np.asarray(edges)
    edges = edges[0] if axis == 0 else edges[:, 0]
    return (edges[1:] + edges[:-1]) / 2


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


def hatched(figure):
    """Hatches of the first panel, and the labels of the legend."""
    hatches = {hatch for area in figure.axes[0].collections for hatch in getattr(area, "hatches", None) or ()}
    return hatches, [text.get_text() for text in figure.legends[0].get_texts()]


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


def test_a_state_keeps_its_colour(chart, dataset):
    handles = {text.get_text(): patch for text, patch in legend(chart)}
    for name in ("0", "U", "U-", "UD"):
        assert to_hex(handles[name].get_facecolor()) == COLOURS[name]
    diagram = studies.plot.bifurcation(dataset, H=0.06)
    drawn = {line.get_label(): line.get_color() for line in diagram.axes[0].get_lines()}
    assert drawn["U"] == COLOURS["U"]
    assert colour("UDUDa") in OTHERS
    assert colour("UD:3") == colour("UD")


def legend(figure):
    (only,) = figure.legends
    return zip(only.get_texts(), only.legend_handles, strict=True)


def test_neighbouring_colours_differ_in_grey():
    def grey(name):
        return np.dot(to_rgb(COLOURS[name]), (0.299, 0.587, 0.114))

    for sequence in (("0", "B1", "U", "U-"), ("U", "UD"), ("U-", "UD-"), ("UD", "UDU")):
        for one, other in pairwise(sequence):
            assert abs(grey(one) - grey(other)) > 0.12, (one, other)


def test_branches_end_at_the_exact_loads(dataset):
    pieces = branches(dataset.isel(ends=0).sel(H=0.1), "P")
    (stable,) = (p for p in pieces if p.state == "U" and p.negative == 0)
    assert stable.values["P"][[0, -1]] == pytest.approx([1.0127127055026, 3.9378211842362], abs=1e-5)
    assert [event.name for event in stable.events] == ["WALL_TOUCHED", "POINT_TO_LINE"]
    again = elastica.solve("U", P=stable.values["P"], H=0.1)
    assert stable.values["shortening"] == pytest.approx(again.shortening, rel=1e-12)


def test_jumps_leave_where_the_state_is_lost(computed):
    """Clamped, H = 0.05: U is lost at the line under load; its asymmetric form at its least shortening."""
    content = SMALL | {"grid": {"ends": [CC], "H": [0.05], "P": {"start": 0.2, "stop": 6.0, "num": 40}}}
    with studies.open(computed(Study.from_dict(content))) as single:
        pieces = branches(single.isel(ends=0, H=0).load(), "P")
        figure = studies.plot.bifurcation(single)
    under_load = {jump.state: jump for jump in jumps(pieces, "P", "P", CC, 0.05)}
    assert under_load["U"].other_state == "UD"
    assert under_load["U"].start["P"] == pytest.approx(3.984869364316, rel=1e-9)
    assert under_load["U"].stop["P"] == pytest.approx(under_load["U"].start["P"], rel=1e-12)
    held = {jump.state: jump for jump in jumps(pieces, "shortening", "P", CC, 0.05)}
    assert (held["Ua"].other_state, held["U"].other_state) == ("U", "Ua")
    assert held["Ua"].start["shortening"] == pytest.approx(0.007386777, abs=1e-9)
    assert held["U"].start["shortening"] == pytest.approx(under_load["U"].start["shortening"], rel=1e-5)
    drawn = {text.get_gid(): text for text in figure.axes[0].texts}
    arrow = drawn["P U UD"]
    assert arrow.xyann[1] == pytest.approx(3.984869364, abs=1e-5)
    assert arrow.xy[0] == pytest.approx(
        float(elastica.solve("UD", P=3.984869364, H=0.05).shortening), rel=1e-3
    )
    assert "where a strip goes that is loaded slowly" in figure.get_supxlabel()


def test_arrows_lead_where_loading_paths_lead(computed):
    """Pinned, H = 0.0484211: where its line is lost the strip goes to UU at P = 3.62, not to Ua at 1.2."""
    grid = {"ends": [PP], "H": [0.0484211], "P": {"start": 0.2, "stop": 4.5, "num": 20}}
    content = SMALL | {"grid": grid, "states": {"names": ["0", "U", "U-", "Ua", "UU"]}}
    with studies.open(computed(Study.from_dict(content))) as single:
        figure = studies.plot.bifurcation(single)
    drawn = {text.get_gid(): text for text in figure.axes[0].texts}
    assert "shortening U- Ua" not in drawn
    arrow = drawn["shortening U- UU"]
    lost = arrow.xyann[0]
    path = studies.loading_path(PP, 0.0484211, shortening=[0.99 * lost, 1.0001 * lost])
    assert path["state"].values.tolist() == ["U-", "UU"]
    assert path["event_control"][1] == pytest.approx(lost, rel=1e-9)
    assert arrow.xy[0] == pytest.approx(lost, rel=1e-9)
    assert arrow.xy[1] == pytest.approx(float(path["P"][1]), rel=2e-3)
    assert arrow.xy[1] == pytest.approx(3.62, abs=0.05)


def test_where_no_arrow_can_be_told_the_caption_says_so(computed):
    grid = {"ends": [CC], "H": [0.1, 0.11], "P": {"start": 5.0, "stop": 8.0, "num": 13}}
    content = SMALL | {"grid": grid, "states": {"names": ["UD"]}}
    with studies.open(computed(Study.from_dict(content))) as single:
        figure = studies.plot.bifurcation(single, H=0.1)
        other = studies.plot.bifurcation(single, H=0.112)
    text = figure.get_supxlabel()
    assert "UD is lost at the load 6.962 (clamped-clamped): it cannot be told where the strip goes" in text
    assert not [t for t in figure.axes[0].texts if (t.get_gid() or "").startswith("P UD ")]
    assert text.startswith("H = 0.1;")
    assert other.get_supxlabel().startswith("H = 0.11, the label next to 0.112;")


def test_of_chains_there_are_no_arrows(computed):
    grid = {"ends": [CC], "H": [0.1], "P": {"start": 1.0, "stop": 4.5, "num": 8}}
    solved = {"method": "chain", "links": 40}
    content = SMALL | {"grid": grid, "states": {"names": ["U", "UD"]}, "solve": solved}
    with studies.open(computed(Study.from_dict(content))) as single:
        figure = studies.plot.bifurcation(single)
    assert "no arrows: of the exact method only" in figure.get_supxlabel()
    assert not figure.axes[0].texts


def test_strips_touch_the_walls_where_the_reactions_push(dataset):
    figure = studies.plot.shapes(dataset, H=0.1, given=3.1, states=["U", "UD"])
    assert [ax.get_title("left").split()[0] for ax in figure.axes] == ["U", "UD"]
    ax = figure.axes[1]
    dots = np.array([line.get_xydata()[0] for line in ax.get_lines() if line.get_marker() == "o"])
    assert dots[:, 1] == pytest.approx([0.1, -0.1], abs=1e-4)
    P = dataset["P"].sel(P=3.1, method="nearest")
    reaction = elastica.solve("UD", P=P, H=0.1).reaction
    arrows = [text.xyann[1] - text.xy[1] for text in ax.texts]
    assert np.sign(arrows).tolist() == [1, -1]
    assert np.abs(arrows) == pytest.approx(0.15 * reaction / reaction.max(), rel=1e-6)


def arrows(ax):
    """Place along the walls and length of each arrow, from left to right."""
    return np.array(
        sorted((text.xy[0] * 0 + text.xyann[0], abs(text.xyann[1] - text.xy[1])) for text in ax.texts)
    )


@pytest.mark.parametrize(
    ("state", "P", "H", "ends"),
    [("U-", 6.0, 0.1, CC), ("Ua-", 3.5, 0.1, PP), ("UD-", 3.9, 0.08, PP), ("UDU-", 17.0, 0.05, CC)],
)
def test_a_line_presses_at_both_of_its_ends(state, P, H, ends):
    """Each end with what its own free segment needs: the slope of the bending moment there."""
    strip = Configuration.at(P, H, state, ends)
    s = strip.solution
    places, forces = np.array(strip.presses).T
    assert places.size == 2 * s.reaction.shape[-1]
    shape = s.shape(50_001)
    shear = np.gradient(np.gradient(shape.theta[0], shape.s), shape.s)
    for place, force in zip(places, forces, strict=True):
        left, right = (np.interp(place + side, shape.s, shear) for side in (-2e-4, 2e-4))
        assert abs(right - left) / (4 * np.pi**2) == pytest.approx(force, rel=2e-2)
    pairs = forces.reshape(-1, 2)
    assert pairs.sum(axis=1) == pytest.approx(s.reaction[0], rel=1e-12)
    # From pin to wall is half the way from wall to wall, with the same force; from a clamp it is another.
    assert (np.ptp(pairs, axis=1) > 0.01).any() == (state in ("Ua-", "UDU-"))
    ax = draw([strip]).axes[0]
    drawn = arrows(ax)
    assert drawn[:, 0] == pytest.approx(np.sort(np.interp(places, shape.s, shape.x[0])), abs=1e-4)
    assert drawn[:, 1] / drawn[:, 1].max() == pytest.approx(forces / forces.max(), rel=1e-9)


def test_unstable_strips_are_hollow(dataset):
    figure = studies.plot.shapes(dataset, H=0.1, states=["Ua"])
    assert len(figure.axes) > 2
    for ax in figure.axes:
        assert "unstable, index 1" in ax.get_title("left")
        assert "white" in {line.get_color() for line in ax.get_lines()}


def test_a_film_has_a_frame_for_each_point_of_a_loading_path(tmp_path):
    from PIL import Image

    path = studies.loading_path(CC, H=0.1, P=[0.9, 2.0, 3.9, 4.2, 3.9])
    points = [(P, 0.1, state, CC) for P, state in zip(path.P.values, path.state.values, strict=True)]
    assert [state for _, _, state, _ in points] == ["0", "U", "U", "UD", "UD"]
    studies.plot.film(points, tmp_path / "loop.gif")
    with Image.open(tmp_path / "loop.gif") as image:
        assert image.n_frames == 5
    assert all(Configuration.at(*point).stable for point in points)
    with pytest.raises(StudyError, match="no equilibrium"):
        studies.plot.film([(9.9, 0.2, "UDU", CC)], tmp_path / "none.gif")


@pytest.fixture
def coarse(monkeypatch):
    """Pictures of few points: what they show does not depend on it."""
    monkeypatch.setattr("studies.plot.regions.FINE", (9, 29))
    monkeypatch.setattr("studies.plot.regions.TRACED", (9, 29))


def painted(figure, panel=0):
    """Colours of a panel, of shape (control, H, 3)."""
    return np.asarray(figure.axes[panel].collections[0].get_array())


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


@pytest.mark.parametrize("kind", ["chart", "bifurcation", "shapes"])
def test_datasets_that_mean_two_things_are_refused(dataset, kind):
    twice = xarray.concat([dataset, dataset.isel(H=[2])], "H")
    for wrong, message in (
        (twice, r"H = 0.08 comes twice .*drop_duplicates\('H'\)"),
        (dataset.isel(state=[0, 2, 2]), "state = U comes twice"),
        (dataset.isel(ends=[1, 1]), "ends = pinned-pinned comes twice"),
        (
            dataset.assign_coords(H=("H", [0.04, 0.06, np.nan, 0.1, 0.12], {"units": "1"})),
            "labels of H are not all finite",
        ),
        (xarray.concat([dataset, dataset], "source"), "has the dimension 'source' as well"),
        (dataset.stack(point=("H", "P")), "'H' is no axis of the dataset"),
    ):
        with pytest.raises(StudyError, match=message):
            getattr(wrong.elastica.plot, kind)()


@pytest.fixture
def ruler():
    return elastica.Strip(length=0.3, width=0.025, thickness=0.001, E=200e9)


def test_physical_charts_have_the_same_borders_in_newtons_and_metres(dataset, ruler, coarse):
    dataset = dataset.isel(ends=[1])
    real = dataset.elastica.physical(ruler)
    scales = np.array([ruler.distance(1.0), ruler.force(1.0)])
    for options in ({"show": "preferred"}, {"show": "energy", "state": "U"}):
        numbers, newtons = (data.elastica.plot.chart(**options) for data in (dataset, real))
        for plain, ax in zip(numbers.axes[:1], newtons.axes[:1], strict=True):
            assert len(ax.get_lines()) == len(plain.get_lines()) > 2
            for line, other in zip(plain.get_lines(), ax.get_lines(), strict=True):
                assert other.get_label() == line.get_label()
                np.testing.assert_allclose(other.get_xydata(), line.get_xydata() * scales, rtol=1e-11)
            assert ax.get_xlabel().endswith("[m]") and newtons.axes[0].get_ylabel().endswith("[N]")
            assert ax.get_xlim() == pytest.approx(np.array(plain.get_xlim()) * scales[0])
        assert "exactly" in newtons.get_supxlabel() and "length 0.3 m, width" in newtons.get_supxlabel()
    energies = [np.nanmax(f.axes[0].collections[0].get_array()) for f in (numbers, newtons)]
    assert energies[1] == pytest.approx(ruler.energy(energies[0])) and newtons.axes[1].get_ylabel().endswith(
        "[J]"
    )


def test_physical_bifurcation_diagrams_and_shapes(dataset, ruler):
    real = dataset.elastica.physical(ruler)
    scales = np.array([ruler.distance(1.0), ruler.force(1.0)])
    numbers = studies.plot.bifurcation(dataset, H=0.1, states=["B1", "U", "Ua"])
    newtons = studies.plot.bifurcation(real, H=0.03, states=["B1", "U", "Ua"])
    for line, other in zip(numbers.axes[0].get_lines(), newtons.axes[0].get_lines(), strict=True):
        np.testing.assert_allclose(other.get_xydata(), line.get_xydata() * scales, rtol=1e-9)
    for text, other in zip(numbers.axes[0].texts, newtons.axes[0].texts, strict=True):
        assert np.array(other.xy) == pytest.approx(np.array(text.xy) * scales)
    assert "[m]" in newtons.axes[0].get_xlabel() and "H = 0.03 m" in newtons.get_supxlabel()
    P = ruler.force(float(dataset["P"][7]))
    strips = studies.plot.shapes(real, H=0.03, given=P, states=["U"])
    assert f"P = {P:.4g} N" in strips.axes[0].get_title("left")
    assert f"{ruler.force(elastica.solve('U', P=dataset['P'][7].item(), H=0.1).reaction.max()):.4g} N" in (
        strips.get_supxlabel()
    )
    with pytest.raises(StudyError, match=r"P = 1e\+06 is not in the dataset; give one from"):
        studies.plot.shapes(real, H=0.03, given=1e6)


@pytest.mark.parametrize("kind", ["chart", "bifurcation", "shapes"])
def test_units_that_are_not_understood_are_refused(dataset, ruler, kind):
    real = dataset.elastica.physical(ruler)
    inches = real.assign_coords(H=("H", real["H"].values / 0.0254, {"units": "in"}))
    for wrong, message in (
        (dataset.drop_attrs(), r"H has lost its attribute 'units': is it a number, or in m\?"),
        (real.drop_attrs(), "has lost its attribute 'units'"),
        (real.assign_coords(P=("P", real["P"].values)), "P has lost its attribute 'units'"),
        (real.assign_coords(H=real["H"] * 1000), "H = 40 L cannot be; are its units right"),
        (inches, "H is in units 'in', which are not understood; use 1 or m"),
        (real.drop_attrs(deep=False), "no attribute 'strip' says of which strip"),
    ):
        with pytest.raises(StudyError, match=message):
            getattr(wrong.elastica.plot, kind)()


def test_millimetres_are_understood(dataset, ruler):
    real = dataset.elastica.physical(ruler)
    real = real.assign_coords(H=("H", real["H"].values * 1000, {"units": "mm"}))
    strips = real.elastica.plot.shapes(H=30.0, states=["U"])
    assert "H = 30 mm" in strips.get_supxlabel()


@pytest.mark.parametrize("kind", ["chart", "bifurcation", "shapes"])
def test_figures_look_as_they_did(kind, dataset, tmp_path, chart):
    """Up to fonts. Where a change is meant, the new picture stands in pytest's folder of this test."""
    figure = chart if kind == "chart" else getattr(studies.plot, kind)(dataset, H=0.1)
    figure.savefig(tmp_path / f"{kind}.png", dpi=50)
    expected = shutil.copy(BASELINES / f"{kind}.png", tmp_path / f"{kind}-expected.png")
    assert compare_images(expected, tmp_path / f"{kind}.png", tol=12) is None


def plotted(*arguments):
    return CliRunner().invoke(main, ["plot", *map(str, arguments)])


def test_shapes_say_how_many_of_how_many_they_drew(dataset, file, tmp_path):
    many = studies.plot.shapes(
        dataset, H=0.1, given=list(dataset["P"].values), states=["U", "UD", "B1", "Ua"]
    )
    solved = (dataset["status"].isel(ends=0).sel(H=0.1, state=["U", "UD", "B1", "Ua"]) == 0).sum()
    assert len(many.axes) == 12 < solved and f"12 of {int(solved)} strips are drawn" in many.get_supxlabel()
    out = tmp_path / "many.png"
    loads = [part for P in dataset["P"].values[1:] for part in ("--P", P)]
    told = plotted(file, "--kind", "shapes", "--H", 0.1, *loads, "-o", out)
    assert told.exit_code == 0 and f"{out}: 12 of " in told.output
    few = plotted(file, "--kind", "shapes", "--H", 0.1, "--P", 3, "-o", out)
    assert few.output == f"{out}\n"


def test_stable_strips_come_first(dataset):
    """A clamped line has no negative direction and is unstable at third order: it comes after them."""
    content = dataset.sel(state=["U-", "Ua", "UD", "0", "U", "B1"])
    drawn = studies.plot.shapes(content, H=0.1, given=4.4).axes
    titles = [ax.get_title("left") for ax in drawn]
    assert titles[0].startswith("UD ") and titles[0].endswith("stable")
    assert titles[1].startswith("U- ") and "third" in titles[1]
    verdicts = ["stable" in title.split("ΔL")[1] and "unstable" not in title for title in titles]
    assert verdicts == sorted(verdicts, reverse=True)


@pytest.mark.parametrize("ending", ["png", "pdf", "svg"])
def test_a_figure_is_replaced_only_by_a_whole_one(dataset, tmp_path, monkeypatch, ending):
    out = tmp_path / f"figure.{ending}"
    figure = studies.plot.shapes(dataset, H=0.1, given=3, states=["U"])
    studies.plot.save(figure, out)
    whole = out.read_bytes()
    assert len(whole) > 1000

    def full(source, target):
        Path(target).write_bytes(whole[:100])
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with monkeypatch.context() as patched, pytest.raises(StudyError, match=r"No space left .* is kept"):
        patched.setattr("shutil.copyfile", full)
        studies.plot.save(figure, out)
    assert out.read_bytes() == whole and os.listdir(tmp_path) == [out.name]
    with pytest.raises(StudyError, match="could not be written"):
        studies.plot.save(figure, tmp_path / "nowhere" / out.name)


def test_neither_latex_settings_nor_titles_stop_a_figure(dataset, tmp_path):
    """Whoever writes with LaTeX by default need not have it, and a title is no formula."""
    odd = dataset.assign_attrs(title=r"50 % & $\\undefined_{ x")
    with matplotlib.rc_context({"text.usetex": True}):
        figure = studies.plot.shapes(odd, H=0.1, given=3, states=["U"])
        studies.plot.save(figure, tmp_path / "figure.svg")
        studies.plot.save(studies.plot.bifurcation(odd, H=0.1, states=["U"]), tmp_path / "figure.pdf")
    assert "50 % &amp; $" in (tmp_path / "figure.svg").read_text()


def test_letters_stay_letters(file, tmp_path):
    result = plotted(file, "--kind", "shapes", "--H", 0.1, "--P", 3, "--state", "U", "-o", tmp_path / "u.svg")
    assert result.exit_code == 0, result.output
    drawing = (tmp_path / "u.svg").read_text()
    assert "<text" in drawing
    assert "longest arrow" in drawing


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--show", "colour"], "use stable, preferred, count or one of"),
        (["--show", "energy"], "show = 'energy' needs a state; name one of 0"),
        (["--show", "energy", "--state", "UDU"], "name one of 0"),
        (["--P", "3"], "--P has no meaning for --kind chart"),
        (["--kind", "shapes", "--H", "0.4"], "H = 0.4 is not in the dataset"),
        (["--kind", "shapes", "--ends", "clamped-pinned"], "is none of the dataset's"),
        (["--kind", "shapes", "--state", "U", "--P", "0.2"], "no state is solved at H"),
        (["--kind", "bifurcation", "--show", "P"], "use shortening"),
        (["-o", "picture.bmp"], "use .png, .pdf or .svg"),
    ],
)
def test_mistakes_are_one_sentence(file, arguments, message):
    result = plotted(file, *arguments)
    assert result.exit_code == 2
    assert message in result.output
    assert len(result.output.strip().splitlines()) == 1


def test_half_a_dataset_is_drawn_as_far_as_it_goes(dataset):
    with pytest.raises(StudyError, match="no variable 'stability'"):
        studies.plot.chart(dataset.drop_vars("stability"))
    with pytest.raises(StudyError, match="no variable 'energy'"):
        studies.plot.chart(dataset.drop_vars("energy"), show="preferred")
    half = dataset.isel(ends=[1]).drop_vars(["energy", "preferred_state"])
    half["status"] = half["status"].where(~half["state"].isin(["U-", "UD"]), -1)
    figure = studies.plot.chart(half)
    assert "not computed, or only in part: U-, UD" in figure.get_supxlabel()
    assert len(studies.plot.bifurcation(half.drop_vars("stability"), H=0.1).axes) == 1


def test_points_that_were_not_computed_take_the_nearest(dataset, chart):
    thinned = dataset.isel(ends=[0]).copy(deep=True)
    thinned["status"][:, :, 5::7] = -1
    whole = chart.axes[0].collections[0].get_array()
    holes = studies.plot.chart(thinned).axes[0].collections[0].get_array()
    assert np.isclose(whole, holes).all(axis=-1).mean() > 0.97


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


def test_what_a_selection_took_away_is_drawn_too(dataset):
    one = dataset.sel(H=0.08, ends=CC).elastica.plot
    assert [ax.get_title() for ax in one.bifurcation().axes] == [CC]
    assert len(one.shapes(given=2.5, states=["U"]).axes) == 1
    assert len(dataset.sel(state="U").elastica.plot.chart(show="curvature", state="U").axes) == 3
    with pytest.raises(StudyError, match="fewer than two values of H"):
        one.chart()
    with pytest.raises(StudyError, match="no labels of 'ends'; select without drop=True"):
        dataset.isel(ends=0, drop=True).elastica.plot.chart()
    with pytest.raises(StudyError, match="no value of H"):
        dataset.isel(H=slice(0, 0)).elastica.plot.shapes()


def test_strips_are_drawn_where_they_were_asked_for_or_not_at_all(file, tmp_path):
    for option, value, message in (
        ("--shortening", "0.02", "P is prescribed in this dataset; choose points by --P"),
        ("--P", "99", "P = 99 is not in the dataset; give one from 0.2 to 6"),
        ("--P", "nan", "P = nan is not in the dataset"),
    ):
        out = tmp_path / "strips.png"
        answer = plotted(file, "--kind", "shapes", option, value, "-o", out)
        assert answer.exit_code == 2 and message in answer.output and not out.exists()
