"""A new layout of the project changes no value: every study and every answer has the hash that it had before.

    OPENBLAS_NUM_THREADS=1 .venv/bin/python -m pytest -q -p no:cacheprovider tests/same_values/check.py

takes about 80 s of processor time, on a busy machine up to 150 s. With --full the four studies of the
catalogue that are thinned otherwise are computed whole, for about 15 s more.

Plain `pytest` does not collect it, for the hashes are those of one machine: other vector units of the
processor, or another numpy or scipy, round otherwise (`made_with` in `hashes.json`). There, make them anew
with the code before: `make_hashes.py`. After the `elastica` command has moved to another module, install the
package again. All this goes when the new layout stands.

What a dataset says about its origin (version, commit, times, host, history) is not in its content hash; its
values, labels, units and meanings of flags are. Of answers every bit of every array counts (all NaN alike),
and the reasons why points failed.
"""

import json
import signal
import sys
import warnings
from importlib.metadata import entry_points

import pytest
import tomli_w
from distributed import Client, LocalCluster
from make_hashes import HASHES, answer_hash, catalogue, content_hash, thinned

import studies

KEPT = json.loads(HASHES.read_text())
RANDOM = KEPT["random"]
ANSWERS = KEPT["answers"]


@pytest.fixture(autouse=True)
def any_warning():
    """Coarse chains warn, and are to."""
    with warnings.catch_warnings(action="ignore", category=UserWarning):
        yield


def elastica(*arguments):
    """Run the command as its script does, in this process; points may fail, which has a status of its own."""
    (script,) = entry_points(group="console_scripts", name="elastica")
    with pytest.MonkeyPatch.context() as patch, pytest.raises(SystemExit) as end:
        patch.setattr(sys, "argv", ["elastica", *map(str, arguments)])
        # What the command does about signals is not for the tests after it.
        patch.setattr(signal, "signal", lambda *_: None)
        script.load()()
    assert end.value.code in (0, 3)


@pytest.mark.parametrize("name", KEPT["catalogue"])
def test_a_study_of_the_catalogue(name, full, tmp_path):
    if full:
        assert content_hash(catalogue(name), tmp_path, workers=0) == KEPT["catalogue"][name]
    else:
        expected = (KEPT["catalogue"] | KEPT["thinned"])[name]
        assert content_hash(thinned(name), tmp_path, workers=0) == expected


@pytest.mark.parametrize("name", RANDOM)
def test_a_random_study(name, tmp_path):
    kept = RANDOM[name]
    assert content_hash(kept["study"], tmp_path, workers=0) == kept["content_hash"]


@pytest.fixture(scope="module")
def client():
    """Two workers of a cluster, which need not be started for each study."""
    workers = LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None)
    with workers as cluster, Client(cluster) as client:
        yield client


@pytest.mark.parametrize("name", KEPT["two_workers"])
def test_a_random_study_by_two_workers(name, request, tmp_path):
    kept = RANDOM[name]
    own = name in KEPT["two_workers"][:3]
    who = {"workers": 2} if own else {"client": request.getfixturevalue("client")}
    # In blocks so small that both workers have something to do.
    assert content_hash(kept["study"], tmp_path, block_points=5, **who) == kept["content_hash"]


@pytest.mark.parametrize("name", KEPT["shards"])
def test_a_random_study_in_shards(name, tmp_path):
    kept = RANDOM[name]
    study, out = tmp_path / "study.toml", tmp_path / "joined.nc"
    study.write_text(tomli_w.dumps(kept["study"]))
    for part in ("2/2", "1/2"):
        elastica("run", study, "-o", out, "--workers", 0, "--shard", part)
        assert not out.exists()
    elastica("reduce", study, "-o", out)
    with studies.open(out) as dataset:
        assert dataset.attrs["content_hash"] == kept["content_hash"]


@pytest.mark.parametrize("number", range(len(ANSWERS)))
def test_an_answer(number):
    kept = ANSWERS[number]
    assert answer_hash(kept["call"], KEPT["attributes"]) == kept["sha256"], kept["call"]
