"""`elastica accuracy --scale`: whole studies, what they cost, and what is refused."""

import pytest
import xarray as xr
from click.testing import CliRunner

from studies.accuracy import scale
from studies.command_line import main


def measure(folder, points):
    return CliRunner().invoke(main, ["accuracy", "-o", str(folder), "--scale", points, "--workers", "1"])


def test_costs_of_a_small_study(tmp_path, monkeypatch):
    monkeypatch.setattr(scale, "OUTPUTS", {"maps": ""})
    monkeypatch.setattr(scale, "LAYOUTS", scale.LAYOUTS[:2])
    folder = tmp_path / "made"
    result = measure(folder, "1e3")
    assert result.exit_code == 0, result.output
    assert sorted(path.name for path in folder.iterdir()) == ["scale.md", "scale.nc", "scale.png"]
    assert "| 1,000 |" in result.stdout
    with xr.open_dataset(folder / "scale.nc") as data:
        spent = data.sel(points=1000)
        assert 0.01 < spent["solving"] < spent["shards"] + spent["solving"]
        assert min(spent["client_memory"], spent["worker_memory"]) > 50e6
        assert spent["file_bytes"] > 1000 * 4 * 8
        written = data["layout_file_bytes"]
        assert written.sel(layout="no compression") > written.isel(layout=0)
        assert data["outputs_file_bytes"].item() == pytest.approx(scale.POINTS_OF_OUTPUTS * 190, rel=0.3)


@pytest.mark.parametrize("points", ["10", "nan", "-1e9", "inf"])
def test_impossible_numbers_of_points_are_refused(points, tmp_path):
    result = measure(tmp_path / "made", points)
    assert result.exit_code == 2
    assert "give 1,000 to 1,000,000,000 points" in result.stderr
    assert not list(tmp_path.iterdir())
