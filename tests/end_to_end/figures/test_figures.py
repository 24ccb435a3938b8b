"""Figures of every kind: units, files, the look, and what is refused."""

import errno
import os
import shutil
from pathlib import Path

import matplotlib
import numpy as np
import pytest
import xarray
from end_to_end.figures.panels import CC, plotted
from matplotlib.testing.compare import compare_images

import elastica
import studies
from studies import StudyError

BASELINES = Path(__file__).parents[2] / "figures"


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
