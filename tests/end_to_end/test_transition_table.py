"""The transition table: the rows of `elastica.transitions`, whoever finds them and whatever stops the run."""

import copy

import numpy as np
import pytest
import xarray as xr
from compliance_checker.runner import CheckSuite, ComplianceChecker
from end_to_end.test_growing import altered

import elastica
import studies
from elastica import Event
from studies import Study, StudyError
from studies.design.block import Gaps
from studies.running import session
from studies.running.merging import merge
from studies.store.datasets import identify
from studies.store.files import opened

CONTENT = {
    "study": {"name": "events", "title": "Events", "license": "CC-BY-4.0"},
    "grid": {"ends": ["pinned-pinned", "clamped-clamped"], "H": [0.06, 0.1], "P": [0.5, 2.0, 4.0]},
    "states": {"names": ["0", "U-"]},
    "outputs": {"transitions": True},
}
COLUMNS = ("H", "P", "shortening", "state", "other_state", "event", "index_before", "index_after")


def study_with(**tables):
    return Study.from_dict(copy.deepcopy(CONTENT) | tables)


def grid(**axes):
    return {"grid": CONTENT["grid"] | axes}


@pytest.fixture(scope="module")
def table_file(computed):
    return computed(study_with())


def content(path):
    return identify(path)["content_hash"]


def test_the_table_has_the_loads_known_from_closed_formulas_in_order(table_file):
    with studies.open(table_file) as dataset:
        table = dataset.elastica.transitions()
        assert (np.diff(table["H"].sel(transition=table["ends"] == "pinned-pinned")) >= 0).all()
        flat = table.where((table["event"] == Event.FLAT_BUCKLES) & (table["H"] == 0.1), drop=True)
        assert flat["P"].values == pytest.approx([3.8506274993], abs=2e-10)
        assert flat["ends"].values.tolist() == ["pinned-pinned"]


def test_rows_are_those_of_the_function_for_every_state_and_root_of_the_file(computed):
    ends, last = "clamped-clamped", 9.0
    path = computed(
        study_with(grid={"ends": [ends], "H": [0.1], "P": [2.0, last]}, states={"max_contacts": 1})
    )
    with studies.open(path) as dataset:
        names = dataset["state"].values.tolist()
        assert {"U", "U-", "U-:2"} <= set(names)
        for name in names:
            rows = dataset.sel(state=[name]).elastica.transitions()
            wanted = elastica.transitions(name, 0.1, ends, P_max=last)
            own = wanted.P >= 2.0
            wanted = zip(*(getattr(wanted, column)[own].tolist() for column in COLUMNS), strict=True)
            found = zip(*(rows[column].values.tolist() for column in COLUMNS), strict=True)
            # Events at one load are in the order of their codes.
            assert list(found) == sorted(wanted, key=lambda row: (row[1], *row[5:]))
        assert (dataset["transition_P"] >= 2.0).all() and "U-:2" in dataset["transition_state"]


def test_is_found_again_and_passes_the_cf_checker(table_file, tmp_path):
    report, problems = studies.check(table_file, sample=4)
    assert problems == []
    assert any("transitions" in line for line in report)
    CheckSuite.load_all_available_checkers()
    told = tmp_path / "report.txt"
    ComplianceChecker.run_checker(
        str(table_file), ["cf:1.11"], 0, "normal", output_filename=str(told), output_format="text"
    )
    assert "Errors" not in told.read_text(), told.read_text()
    with xr.open_dataset(table_file, engine="h5netcdf") as dataset:
        assert dataset["transition_event"].dtype == np.int8


def test_rows_that_were_changed_or_do_not_belong_are_told(table_file, tmp_path):
    def push(dataset):
        dataset["transition_P"][:] = dataset["transition_P"][:] * (1 - 1e-6)

    def foreign(dataset):
        dataset["transition_event"][0] = 77

    pushed = altered(table_file, tmp_path / "pushed.nc", push)
    assert any("cannot be found again" in problem for problem in studies.check(pushed, sample=3, seed=0)[1])
    strange = altered(table_file, tmp_path / "strange.nc", foreign)
    assert any("do not belong" in problem for problem in studies.check(strange, sample=0)[1])


def test_neither_workers_nor_blocks_matter(table_file, tmp_path):
    studies.run(study_with(), tmp_path / "a.nc", workers=2, block_points=2).close()
    assert content(tmp_path / "a.nc") == content(table_file)


def test_a_run_that_is_stopped_among_the_events_goes_on_from_there(table_file, tmp_path, monkeypatch):
    original, gaps = session.compute_block, []

    def stopping(block, job):
        if isinstance(block, Gaps):
            if len(gaps) == 2:
                raise KeyboardInterrupt
            gaps.append(block)
        return original(block, job)

    out = tmp_path / "a.nc"
    monkeypatch.setattr(session, "compute_block", stopping)
    with pytest.raises(KeyboardInterrupt):
        studies.run(study_with(), out, workers=0, block_points=1)
    monkeypatch.setattr(
        session, "compute_block", lambda block, job: gaps.append(block) or original(block, job)
    )
    studies.run(study_with(), out, workers=0, block_points=1).close()
    assert len(gaps) == len(set(gaps)) == 4
    assert content(out) == content(table_file)
    assert [path.name for path in tmp_path.iterdir()] == ["a.nc"]


def test_grows_and_merges_with_all_rows_of_the_larger_grid(table_file, tmp_path, computed):
    low = computed(study_with(**grid(P=[0.5, 2.0])))
    high = computed(study_with(**grid(P=[2.0, 4.0]), outputs={}))
    studies.run(study_with(), tmp_path / "grown.nc", workers=0, reuse=high).close()
    assert content(tmp_path / "grown.nc") == content(table_file)
    merge([low, high], tmp_path / "merged.nc", fill=True)
    assert content(tmp_path / "merged.nc") == content(table_file)


def test_tables_join_where_they_make_up_that_of_the_whole(
    table_file, tmp_path, computed, monkeypatch, capsys
):
    # They share a gap.
    parts = [computed(study_with(**grid(H=gaps))) for gaps in ([0.06], [0.06, 0.1])]
    low = computed(study_with(**grid(P=[0.5, 2.0])))
    monkeypatch.setattr(session, "compute_block", None)
    capsys.readouterr()
    merge(parts, tmp_path / "merged.nc")
    assert content(tmp_path / "merged.nc") == content(table_file)
    assert "transitions" not in capsys.readouterr().err
    merge([low, parts[0]], tmp_path / "without.nc")
    told = capsys.readouterr().err
    assert "transitions: left out, since the tables of the datasets do not make up" in told
    assert "--fill (in Python fill=True) finds them, in 2 s of work" in told
    with studies.open(tmp_path / "without.nc") as dataset:
        assert "transition" not in dataset.dims
    assert studies.check(tmp_path / "without.nc")[1] == []


def test_a_study_that_does_not_ask_has_no_trace_of_it(tmp_path):
    plain, without = study_with(outputs={}), study_with(outputs={"transitions": False})
    assert plain.study_id == without.study_id == "7d9fa17f3bf0e1c15eae2ffdab910125"
    assert plain.study_id != study_with().study_id
    assert "transitions" not in plain.config_json
    studies.run(without, tmp_path / "a.nc", workers=0).close()
    with studies.open(tmp_path / "a.nc") as dataset:
        assert not [name for name in (*dataset.variables, *dataset.dims) if "transition" in name]
        with pytest.raises(StudyError, match="transitions = true"):
            dataset.elastica.transitions()


def test_a_study_without_an_event_has_no_table(computed):
    with studies.open(
        computed(study_with(**grid(H=[0.1], P=[0.3, 0.4]), states={"names": ["U-"]}))
    ) as dataset:
        assert "transition" not in dataset.dims


def test_what_fails_is_told_and_costs_one_state_at_one_gap(table_file, tmp_path, monkeypatch):
    from studies.running import evaluate

    original = evaluate.transitions

    def failing(name, H, *arguments, **more):
        if name == "U-" and 0.06 in H:
            raise ArithmeticError("poison")
        return original(name, H, *arguments, **more)

    monkeypatch.setattr(evaluate, "transitions", failing)
    out = tmp_path / "a.nc"
    studies.run(study_with(**grid(ends=["pinned-pinned"])), out, workers=0).close()
    monkeypatch.undo()
    assert identify(out)["transitions_failed"] == "pinned-pinned H=0.06 U-: ArithmeticError: poison"
    with studies.open(out) as dataset, studies.open(table_file) as whole:
        lost = whole.sel(ends="pinned-pinned", H=0.06).sel(state="U-").elastica.transitions()
        all_rows = whole.sel(ends="pinned-pinned").elastica.transitions()
        assert lost.sizes["transition"] > 0
        assert dataset.sizes["transition"] == all_rows.sizes["transition"] - lost.sizes["transition"]
    assert studies.check(out, sample=12)[1] == []
    with opened(out, "a") as dataset:
        dataset.delncattr("transitions_failed")
    assert any("content_hash" in problem for problem in studies.check(out, sample=0)[1])


@pytest.mark.parametrize(
    ("tables", "sentence"),
    [
        ({"grid": {"ends": ["pinned-pinned"], "H": [0.1], "shortening": [0.01]}}, "shortening is prescribed"),
        ({"solve": {"method": "chain", "links": 40}}, 'needs solve.method = "exact", not "chain"'),
        (grid(P=[1.0, 101.0]), "P ends at 101"),
        ({"outputs": {"transitions": 1}}, "outputs.transitions = 1 is not allowed"),
    ],
)
def test_what_has_no_table_is_refused(tables, sentence):
    with pytest.raises(StudyError, match=sentence) as refused:
        study_with(**tables)
    assert str(refused.value).count("outputs.transitions") == 1
