"""Bifurcation figures: branches end, and arrows lead, where the strip does."""

import pytest
from end_to_end.figures.panels import CC, PP, SMALL

import elastica
import studies
from studies import Study
from studies.plot.branches import branches, jumps


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
