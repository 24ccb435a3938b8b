"""Files of an older format and older numerics open, plot, check and merge among themselves."""

import matplotlib.pyplot as plt
import numpy as np
import pytest

import studies
from elastica.codes import Status
from studies.design.request import NUMERICS_VERSION
from studies.design.study import Study
from studies.errors import StudyError
from studies.running.merging import merge
from studies.store.content import content_hash
from studies.store.files import opened


def computed(H, path, **outputs):
    grid = {"ends": ["pinned-pinned"], "H": H, "P": [0.2, 0.5, 2.0]}
    content = {"study": {"name": "old"}, "grid": grid, "states": {"names": ["0", "U", "B1"]}}
    study = Study.from_dict(content | {"outputs": outputs})
    studies.run(study, path, workers=0).close()
    return aged(path)


def aged(path, meanings="solved no_equilibrium inadmissible failed not_computed"):
    with opened(path, "a") as dataset:
        status = dataset["status"]
        assert not (status[:] == Status.NOT_FOLLOWED).any()
        status.setncatts({"flag_values": np.array([0, 1, 2, 3, -1], "i1"), "flag_meanings": meanings})
        dataset.setncatts({"format_version": 1, "numerics_version": 3, "numerics_id": "of then"})
    digest = content_hash(path)
    with opened(path, "a") as dataset:
        dataset.setncattr("content_hash", digest)
    return path


def test_they_open_plot_check_and_merge(tmp_path):
    one, other = computed([0.05, 0.06], tmp_path / "a.nc"), computed([0.1], tmp_path / "b.nc")
    merge([one, other], tmp_path / "c.nc")
    for path in (one, tmp_path / "c.nc"):
        report, problems = studies.check(path)
        assert problems == []
        again = f"solved again by version {NUMERICS_VERSION} of the numerics, computed by version 3"
        assert any(again in line for line in report)
        assert report[-1] == "  good"
        with studies.open(path) as dataset:
            studies.plot.chart(dataset)
            plt.close("all")


def test_of_their_codes_each_must_be_one_of_ours(tmp_path):
    path = aged(computed([0.05], tmp_path / "a.nc"), "solved inadmissible no_equilibrium failed not_computed")
    with pytest.raises(StudyError, match=r"status has the attribute flag_.* would be misread"):
        studies.check(path)


def test_nothing_can_be_computed_to_join_them(tmp_path):
    one = computed([0.05], tmp_path / "a.nc", transitions=True)
    other = computed([0.1], tmp_path / "b.nc")
    with pytest.raises(StudyError, match=r"version 3 of the numerics.* their transitions would have to be"):
        merge([one, other], tmp_path / "c.nc", fill=True)
    assert not (tmp_path / "c.nc").exists()
    merge([one, other], tmp_path / "c.nc")
    assert studies.check(tmp_path / "c.nc")[1] == []
