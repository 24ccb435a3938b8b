"""A study of chains gives the same dataset as the exact solver, so that two files can be subtracted."""

import re

import numpy as np
import pytest
import xarray as xr

import studies
from elastica.codes import Stability, Status
from studies.design.study import Study
from studies.errors import StudyError

GRID = {"ends": ["clamped-clamped", "pinned-pinned"], "H": [0.05, 0.1], "P": [0.5, 2.5, 4.5]}


def study(solve, states=None, grid=GRID):
    return Study.from_dict(
        {
            "study": {"name": "chain"},
            "grid": grid,
            "states": states or {"names": ["U", "Ua", "U-", "UD"]},
            "solve": solve,
            "outputs": {"eigenvalues": 2, "shapes": 11},
        }
    )


def test_a_chain_and_the_strip_can_be_subtracted(tmp_path):
    exact = studies.run(study({"method": "exact"}), out=tmp_path / "exact.nc", workers=0)
    chain = studies.run(study({"method": "chain", "links": 400}), out=tmp_path / "chain.nc", workers=0)
    assert chain.attrs["numerics_id"] != exact.attrs["numerics_id"]
    xr.align(exact, chain, join="exact")
    both = (exact.status == Status.SOLVED) & (chain.status == Status.SOLVED)
    assert (exact.status == Status.SOLVED).equals(chain.status == Status.SOLVED)
    assert both.sum() > 12
    assert exact.stability.equals(chain.stability)
    for name in ("curvature", "energy", "reaction", "eigenvalue", "y"):
        difference = np.abs(chain[name] - exact[name]).where(both) / (1 + np.abs(exact[name]))
        assert 1e-12 < difference.max() < 2e-3, name


def test_every_root_of_a_search(tmp_path):
    grid = {"ends": ["clamped-clamped"], "H": [0.1], "P": [3.0, 6.0]}
    states = {"max_contacts": 2}
    exact = studies.run(study({}, states, grid), out=tmp_path / "exact.nc", workers=0)
    chain = studies.run(study({"method": "chain"}, states, grid), out=tmp_path / "chain.nc", workers=0)
    assert set(exact.state.values) == set(chain.state.values)
    stable = exact.stability == Stability.STABLE
    assert stable.equals(chain.stability == Stability.STABLE)


def test_a_softer_strip_has_less_energy(tmp_path):
    grid = GRID | {"ends": ["clamped-clamped"], "P": [1.5, 2.5]}
    uniform = studies.run(study({}, {"names": ["U"]}, grid), out=tmp_path / "uniform.nc", workers=0)
    soft = {"method": "chain", "links": 200, "stiffness": [1.0, 0.8, 1.0]}
    soft = studies.run(study(soft, {"names": ["U"]}, grid), out=tmp_path / "soft.nc", workers=0)
    assert (soft.stability == Stability.STABLE).all()
    # The stiff strip's shape is possible for the soft one too, at less energy.
    assert (soft.energy < uniform.energy).all()


@pytest.mark.parametrize(
    ("solve", "states", "words"),
    [
        ({"links": 100}, None, 'add method = "chain"'),
        ({"method": "chain", "links": 3}, None, "at least 4"),
        ({"method": "chain", "links": 11}, {"names": ["U", "UD"]}, "at least 12"),
        ({"method": "chain", "clamp": "penalty"}, None, "use one of consistent, published"),
        ({"method": "chain", "stiffness": [1.0, 0.0]}, None, "must be a positive number"),
        ({"method": "chain", "links": 10, "stiffness": [1.0] * 12}, {"names": ["U"]}, "use links = 11"),
        ({"method": "chain", "stiffness": [1.0, 2.0]}, {"max_contacts": 1}, "name those of this one"),
        ({"method": "chain", "clamp": "published"}, {"max_contacts": 2}, "use clamp = 'consistent'"),
        ({"method": "beam"}, None, "exact"),
    ],
)
def test_what_no_chain_can_be_is_refused_before_anything_runs(solve, states, words):
    with pytest.raises(StudyError, match=re.escape(words)):
        study(solve, states)
