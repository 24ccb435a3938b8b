"""Whose shards a run takes: those of the same results by the same versions; the others are kept."""

import json

import pytest
from click.testing import CliRunner

import studies
from studies import Study, StudyError
from studies.command_line import main
from studies.running import session
from studies.running.output import is_done
from studies.running.runner import compute
from studies.running.session import Policy
from studies.store import provenance
from studies.store.datasets import identify
from studies.store.shards import find_shards, folder_of

CONTENT = {
    "study": {"name": "tiny", "title": "Before"},
    "grid": {"ends": ["clamped-clamped"], "H": [0.05, 0.1], "P": [1.5, 3.0]},
    "states": {"names": ["0", "U"]},
}
HERE = Policy(workers=0)


def study(**tables):
    return Study.from_dict(CONTENT | tables)


def plan(**tables):
    return study(**tables).plan(block_points=1)


@pytest.fixture
def out(tmp_path):
    return tmp_path / "tiny.nc"


@pytest.fixture
def blocks_computed(monkeypatch):
    """Blocks that runs compute from here on."""

    done, original = [], session.compute_block
    monkeypatch.setattr(session, "compute_block", lambda *a: done.append(a[0]) or original(*a))
    return done


def names(folder):
    return {path.name for path in folder.iterdir()}


@pytest.mark.parametrize("library", ["constrained-elastica", "numpy", "scipy", "numerics"])
def test_shards_by_other_versions_are_told_computed_again_and_kept(
    out, monkeypatch, capsys, blocks_computed, library
):
    here = provenance.decisive_versions()
    monkeypatch.setattr("studies.store.shards.decisive_versions", lambda: here | {library: "0.9"})
    compute(plan(), out, Policy(workers=0, part=(1, 2)))
    monkeypatch.undo()
    theirs = names(folder_of(out))
    assert len(theirs) == 2
    assert find_shards(folder_of(out), plan().blocks, plan().identity) == {}
    with pytest.raises(StudyError, match="4 of 4 shards are missing"):
        studies.running.runner.join(plan(), out)
    capsys.readouterr()
    blocks_computed.clear()
    compute(plan(), out, HERE)
    told = capsys.readouterr().err
    assert f"2 shards there are not used, they are of other versions ({library} 0.9 there, " in told
    assert told.count("\n") == 1
    assert names(folder_of(out)) == theirs


def test_versions_of_what_only_carries_values_may_differ(out, monkeypatch):
    compute(plan(), out, Policy(workers=0, part=(1, 2)))
    assert set(provenance.decisive_versions()) == {"numerics", "constrained-elastica", "numpy", "scipy"}
    monkeypatch.setattr("studies.running.worker.CARRIERS", ("netCDF4",))
    assert len(find_shards(folder_of(out), plan().blocks, plan().identity)) == 2


def test_a_new_title_after_a_kill_costs_nothing(out, blocks_computed):
    compute(plan(), out, Policy(workers=0, part=(1, 2)))
    text = {"name": "tiny-2", "title": "After", "summary": "s"}
    compute(plan(study=text), out, HERE)
    assert len(blocks_computed) == len(plan().blocks)
    found = identify(out)
    assert (found["title"], found["summary"], found["id"]) == ("After", "s", "tiny-2")
    assert names(out.parent) == {"tiny.nc"}


def test_a_finished_dataset_gets_the_new_texts_of_its_study(out, blocks_computed, capsys):
    first = CONTENT["study"] | {"creator_name": "A. N. Other"}
    studies.run(study(study=first), out, workers=0).close()
    before, count = identify(out), len(blocks_computed)
    with studies.run(study(study={"name": "tiny", "title": "After"}), out, workers=0) as dataset:
        assert dataset.attrs["title"] == "After"
        assert "creator_name" not in dataset.attrs
    assert len(blocks_computed) == count
    assert "its results are those of this study, whose name and texts it has now" in capsys.readouterr().err
    after = identify(out)
    assert after["content_hash"] == before["content_hash"]
    assert after["history"].startswith(before["history"] + "\n")
    assert after["study_id"] == study(study={"name": "tiny", "title": "After"}).study_id
    assert studies.check(out, sample=4)[1] == []
    assert names(out.parent) == {"tiny.nc"}


def test_the_command_says_that_a_finished_study_has_new_texts(out):
    toml = out.with_suffix(".toml")
    for title in ("Before", "After"):
        toml.write_text(
            f'study = {{ name = "tiny", title = "{title}" }}\nstates.names = ["0"]\n'
            '[grid]\nends = ["clamped-clamped"]\nH = [0.1]\nP = [1.0]\n'
        )
        result = CliRunner().invoke(main, ["run", str(toml), "-o", str(out), "--workers", "0"])
        assert result.exit_code == 0, result.output
        assert identify(out)["title"] == title


OTHERS = [
    {"grid": CONTENT["grid"] | {"P": [1.5, 3.5]}},
    {"grid": CONTENT["grid"] | {"H": [0.05, 0.1, 0.15]}},
    {"states": {"names": ["0", "U", "U-"]}},
    {"solve": {"method": "chain", "links": 30}},
    {"outputs": {"eigenvalues": 1}},
]


@pytest.mark.parametrize("tables", OTHERS, ids=[next(iter(tables)) for tables in OTHERS])
def test_another_study_with_the_same_output_keeps_what_the_first_has_computed(
    out, capsys, tables, blocks_computed
):
    compute(plan(), out, Policy(workers=0, part=(1, 2)))
    theirs = names(folder_of(out))
    compute(plan(**tables), out, HERE)
    assert "2 shards there are not used, they are of another study" in capsys.readouterr().err
    assert names(folder_of(out)) == theirs
    with pytest.raises(StudyError, match="holds another study"):
        compute(plan(), out, HERE)
    blocks_computed.clear()
    out.rename(out.with_name("other.nc"))
    compute(plan(), out, HERE)
    assert len(blocks_computed) == 2
    assert names(out.parent) == {"tiny.nc", "other.nc"}


def test_what_is_no_shard_of_this_release_is_kept_and_told(out, capsys):
    folder = folder_of(out)
    folder.mkdir()
    old = folder / f"{'-'.join(['000000'] * 5)}.{'0' * 32}.nc"
    strange = folder / f"{'-'.join(['000000'] * 5)}.{'a' * 16}.{'0' * 32}.nc"
    for path in (old, strange):
        path.write_bytes(b"?")
    compute(plan(), out, HERE)
    told = capsys.readouterr().err
    assert "1 shards there are not used, they are of an older release" in told
    assert "1 shards there are not used, they are of another study or of other versions" in told
    assert names(folder) == {old.name, strange.name}


def test_identity_of_results_is_not_that_of_texts():
    texts = study(study={"name": "b", "title": "t", "license": "l", "references": "r"})
    assert texts.study_id != study().study_id
    assert texts.identity == study().identity
    assert len({study(**tables).results_id for tables in ({}, *OTHERS)}) == len(OTHERS) + 1


def test_a_dataset_whose_study_cannot_be_read_is_another_study(out):
    studies.run(study(), out, workers=0).close()
    from studies.store.files import opened

    with opened(out, "a") as dataset:
        dataset.setncatts({"config_json": json.dumps({"study": {}}), "study_id": "0" * 32})
    with pytest.raises(StudyError, match="holds another study"):
        is_done(study(), out)
