"""Drawn strips touch the walls where the reactions push; which of them are drawn, and in which order."""

import numpy as np
import pytest
from end_to_end.figures.panels import CC, PP, plotted

import elastica
import studies
from studies import StudyError
from studies.plot.shapes import Configuration, draw


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


def test_strips_are_drawn_where_they_were_asked_for_or_not_at_all(file, tmp_path):
    for option, value, message in (
        ("--shortening", "0.02", "P is prescribed in this dataset; choose points by --P"),
        ("--P", "99", "P = 99 is not in the dataset; give one from 0.2 to 6"),
        ("--P", "nan", "P = nan is not in the dataset"),
    ):
        out = tmp_path / "strips.png"
        answer = plotted(file, "--kind", "shapes", option, value, "-o", out)
        assert answer.exit_code == 2 and message in answer.output and not out.exists()
