"""Where the search ended a state is `not_followed`; where its branches ended it has no equilibrium."""

import numpy as np
import pytest
from click.testing import CliRunner
from references.onsets import loads

import elastica
import studies
from elastica import Status
from studies.command_line import main
from studies.design.study import Study
from studies.store.datasets import identify

NO, SOLVED, LOST = Status.NO_EQUILIBRIUM, Status.SOLVED, Status.NOT_FOLLOWED


@pytest.mark.parametrize(
    ("state", "ends", "H", "P", "status"),
    [
        ("U", "clamped-clamped", 0.19, [5.0, 7.655, 7.656, 7.7, 9.0], [NO, SOLVED, LOST, LOST, LOST]),
        ("U:2", "clamped-clamped", 0.19, [7.5, 7.656], [LOST, LOST]),
        ("UDU", "clamped-clamped", 0.3, [2.0, 4.0, 9.0, 70.0], [NO, NO, NO, NO]),
        ("U", "pinned-pinned", 0.48, [0.05, 3.0], [LOST, LOST]),
        ("UU", "pinned-pinned", 0.3, [0.5, 2.0], [NO, LOST]),
        ("Ua", "clamped-clamped", 0.05, [1.5, 80.0], [NO, SOLVED]),
        ("U:90", "clamped-clamped", 0.05, [3.0, 80.0], [NO, LOST]),
        ("B1", "clamped-clamped", 0.05, [0.999], [NO]),
    ],
)
def test_under_load(state, ends, H, P, status):
    found = elastica.solve(state, P=P, H=H, ends=ends).status.tolist()
    assert [Status(code).name for code in found] == [code.name for code in status]


@pytest.mark.parametrize("H", [0.01, 0.05, 0.1, 0.15])
def test_what_ended_below_90_degrees_is_not_there(H):
    line, fold = (float(loads(event, H, "clamped-clamped")) for event in ("point_to_line", "line_ends"))
    assert elastica.solve("U", P=line * (1 + 1e-9), H=H).status != LOST
    assert elastica.solve("Ua", P=line * (1 + 1e-9), H=H).status == NO
    beyond = elastica.solve("U-", P=fold * (1 + 1e-8), H=H)
    assert beyond.periods.any() or beyond.status == NO


@pytest.mark.parametrize(
    ("state", "ends", "H", "shortening", "status"),
    [
        ("U", "pinned-pinned", 0.1, [1e-3, 0.1, 1.2], [NO, SOLVED, LOST]),
        ("U-", "clamped-clamped", 0.1, [1e-3, 0.1, 1.0], [NO, SOLVED, LOST]),
    ],
)
def test_at_prescribed_shortening(state, ends, H, shortening, status):
    found = elastica.solve(state, shortening=shortening, H=H, ends=ends).status.tolist()
    assert [Status(code).name for code in found] == [code.name for code in status]


def test_every_state_says_where_it_was_not_followed():
    found = elastica.find_states(P=[2.0, 8.0], H=[0.1, 0.19], max_contacts=2)
    assert list(found.not_followed) == [1]
    assert {"U", "Ua", "UD", "UU"} <= set(found.not_followed[1])
    assert str(found).splitlines()[-1].startswith("not followed, mostly beyond 90 degrees: U Ua")
    for name in found.not_followed[1]:
        assert elastica.solve(name, P=8.0, H=0.19).status == LOST
    ran = CliRunner().invoke(main, ["solve", "--state", "U", "--P", "8", "--H", "0.19"])
    assert "U is not followed to here" in ran.stderr and "status            not_followed" in ran.stdout


@pytest.mark.at_least(3)
def test_a_dataset_tells_it_whatever_the_blocks(compared, tmp_path):
    grid = {"ends": ["clamped-clamped"], "H": [0.1, 0.19], "P": [3.0, 5.5, 7.7, 9.0]}
    study = Study.from_dict({"study": {"name": "s"}, "grid": grid, "states": {"max_contacts": 1}})
    with studies.run(study, tmp_path / "a.nc", workers=0) as whole:
        status = whole["status"].load()
        for state in whole["state"].values:
            for H in grid["H"]:
                alone = elastica.solve(state, P=grid["P"], H=H).status
                assert status.sel(ends="clamped-clamped", state=state, H=H).values.tolist() == alone.tolist()
        compared(status == LOST)
        assert status.attrs["flag_meanings"].split()[4] == "not_followed"
    studies.run(study, tmp_path / "b.nc", workers=0, block_points=1).close()
    assert identify(tmp_path / "a.nc")["content_hash"] == identify(tmp_path / "b.nc")["content_hash"]
    assert studies.check(tmp_path / "a.nc")[1] == []
    assert np.array_equal(studies.open(tmp_path / "b.nc")["status"], status)
