"""The archive as a user keeps it: datasets go in and are found again."""

import json
import shutil
import subprocess
import sys

import pytest
from end_to_end.catalogs.command import SHIPPED, catalog
from end_to_end.processes import elastica
from netCDF4 import Dataset

import studies
from studies.archive.catalog import Catalog
from studies.archive.keeping import _write
from studies.store.content import content_hash


def test_add_moves_the_file_and_list_tells_what_it_holds(tmp_path, dataset_file):
    shutil.copy(dataset_file, tmp_path / "small.nc")
    (tmp_path / "catalogs").mkdir()
    added = elastica("catalog", "add", "small.nc", cwd=tmp_path)
    assert (added.returncode, added.stderr, added.stdout) == (0, "", "catalogs/small.nc\n")
    files = sorted(path.name for path in (tmp_path / "catalogs").iterdir())
    assert (files, (tmp_path / "small.nc").exists()) == (["index.json", "small.nc"], False)
    assert (tmp_path / "catalogs" / "small.nc").read_bytes() == dataset_file.read_bytes()

    text = catalog("list", folder=tmp_path / "catalogs").stdout
    assert "A small study" in text
    assert "  clamped-clamped, clamped-pinned  H 0.04 … 0.2 (5)  P 0.2 … 9 (12)  " in text
    assert text.startswith("small.nc  ")
    assert text.count("\n") == 1
    [row] = json.loads(elastica("catalog", "list", "--json", cwd=tmp_path).stdout)
    assert (row["name"], row["file"], row["study"]) == ("small.nc", "present", "small")
    assert (row["content_hash"], row["bytes"]) == (content_hash(dataset_file), dataset_file.stat().st_size)
    assert row["outputs"] == {"eigenvalues": 3, "frequencies": 0, "shapes": 11}
    with studies.open(dataset_file) as dataset:
        assert row["states"] == dataset["state"].values.tolist()
        assert row["ends"] == dataset["ends"].values.tolist()

    verified = elastica("catalog", "verify", "--sample", 5, cwd=tmp_path)
    assert (verified.returncode, verified.stdout, verified.stderr) == (0, "small.nc: good\n", "")


def test_the_folder_is_an_option_or_a_variable_or_catalogs_here(archived, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert "small.nc" in catalog("list", folder=archived).output
    monkeypatch.setenv("ELASTICA_CATALOG", str(archived))
    assert "small.nc" in catalog("list").output
    monkeypatch.delenv("ELASTICA_CATALOG")
    nowhere = catalog("list")
    assert (nowhere.exit_code, "catalogs: there is no such folder" in nowhere.output) == (2, True)


@pytest.mark.parametrize(
    ("query", "found"),
    [
        ("--ends clamped-clamped --state U --H 0.05", ["small.nc"]),
        ("--ends clamped/pinned --H 0.2 --P 9", ["small.nc"]),
        ("--state D", ["other.nc", "small.nc"]),
        ("--state aU --ends clamped-clamped", ["small.nc"]),
        ("--ends pinned-pinned --shortening 0.035 --method exact", ["other.nc"]),
        ("--H 0.1", ["other.nc", "small.nc"]),
        ("--H 0.21", []),
        ("--P 9.1", []),
        ("--P 0.035 --ends pinned-pinned", []),
        ("--shortening 0.5", []),
        ("--state UD", []),
        ("--state Ua- --ends clamped-pinned", ["small.nc"]),
        ("--state Ua", ["small.nc"]),
        ("--ends clamped-clamped --state Ua --method chain", []),
    ],
)
def test_find_by_ends_state_gap_and_load(archived, other_file, tmp_path, query, found):
    shutil.copy(other_file, tmp_path / "other.nc")
    assert catalog("add", tmp_path / "other.nc", folder=archived).exit_code == 0
    rows = catalog("find", *query.split(), "--json", folder=archived)
    assert [row["name"] for row in json.loads(rows.stdout)] == found
    words = catalog("find", *query.split(), folder=archived)
    assert [line.split()[0] for line in words.stdout.splitlines()] == found
    assert ("none of 2 datasets holds this" in words.stderr) == (not found)


def test_finding_opens_no_file_and_takes_less_than_a_second_among_a_thousand(archived, record_property):
    read = Catalog.read(archived)
    [entry] = read.entries.values()
    entries = {
        f"{number}.nc": entry.model_copy(update={"H": entry.H.model_copy(update={"stop": number / 2000})})
        for number in range(100, 1100)
    }
    _write(Catalog(archived, entries))
    (archived / "small.nc").rename(archived / "1000.nc")
    code = (
        "import sys, time; from click.testing import CliRunner; import elastica, pydantic;"
        "from studies.command_line import main; start = time.process_time();"
        "result = CliRunner().invoke(main, sys.argv[1:]); seconds = time.process_time() - start;"
        "heavy = {'dask', 'xarray', 'netCDF4', 'matplotlib'} & set(sys.modules);"
        "print(result.stdout, result.stderr.count('the file is gone'), seconds, heavy, sep='\\n')"
    )
    query = f"catalog find --state U --ends clamped-clamped --H 0.5 --catalog {archived} --json"
    run = subprocess.run([sys.executable, "-c", code, *query.split()], capture_output=True, text=True)
    found, _, gone, seconds, heavy = run.stdout.splitlines()
    assert [row["file"] for row in json.loads(found)] == ["present"] + ["gone"] * 99
    assert (gone, heavy) == ("99", "set()")
    record_property("processor seconds of a search among 1,000 entries, without starting Python", seconds)
    assert float(seconds) < 0.4


def test_the_same_dataset_is_not_added_twice(archived, dataset_file, tmp_path):
    copy = tmp_path / "copy.nc"
    shutil.copy(dataset_file, copy)
    refused = catalog("add", copy, folder=archived)
    assert (refused.exit_code, "has this dataset as small.nc" in refused.output) == (2, True)
    inside = catalog("add", archived / "small.nc", folder=archived)
    assert (inside.exit_code, "has this dataset as small.nc" in inside.output) == (2, True)
    assert copy.read_bytes() == (archived / "small.nc").read_bytes()


def test_a_name_that_is_taken_is_refused(archived, other_file, tmp_path):
    shutil.copy(other_file, tmp_path / "small.nc")
    (archived / "other.nc").write_bytes(b"somebody's")
    before = (archived / "index.json").read_text()
    for name in ("small.nc", "other.nc"):
        if name == "other.nc":
            (tmp_path / "small.nc").rename(tmp_path / name)
        refused = catalog("add", tmp_path / name, folder=archived)
        assert (refused.exit_code, f"another file has the name {name}" in refused.output) == (2, True)
    assert (tmp_path / "other.nc").read_bytes() == other_file.read_bytes()
    assert (archived / "other.nc").read_bytes() == b"somebody's"
    assert (archived / "index.json").read_text() == before


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda path: None, "there is no such file"),
        (lambda path: path.mkdir(), "this is no file"),
        (lambda path: path.write_bytes(b"no netCDF"), "this cannot be read as netCDF"),
        (lambda path: Dataset(path, "w").close(), "this is no dataset of constrained-elastica"),
        (lambda path: path.symlink_to(SHIPPED), "this is a link"),
    ],
)
def test_what_is_no_dataset_of_ours_is_refused(archived, tmp_path, make, message):
    path = tmp_path / "strange.nc"
    make(path)
    refused = catalog("add", path, folder=archived)
    assert (refused.exit_code, refused.output.count("\n")) == (2, 1)
    assert f"{path}: {message}" in refused.output
    assert list(Catalog.read(archived).entries) == ["small.nc"]


def test_a_dataset_whose_values_changed_is_not_taken_in(archived, other_file, tmp_path):
    changed = tmp_path / "changed.nc"
    shutil.copy(other_file, changed)
    with Dataset(changed, "a") as dataset:
        dataset.variables["P"][:] *= 1.001
    refused = catalog("add", changed, folder=archived)
    assert (refused.exit_code, "the values are not those that were written" in refused.output) == (2, True)
    assert changed.exists()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--ends", "clamped-free"), "'clamped-free' is not known"),
        (("--state", "Q"), "state = 'Q' is not known"),
        (("--ends", "clamped-clamped", "--state", "Ua-"), "leave out the 'a'"),
        (("--H", "nan"), "H = nan is not a finite number"),
        (("--P", "x"), "'x' is not a number"),
        (("--method", "magic"), "'magic' is not known"),
    ],
)
def test_queries_that_make_no_sense(archived, arguments, message):
    result = catalog("find", *arguments, folder=archived)
    assert (result.exit_code, message in result.output) == (2, True)


def test_a_file_that_lies_in_the_folder_gets_its_entry_where_it_is(archived, other_file):
    shutil.copy(other_file, archived / "other.nc")
    assert "other.nc: not in the index" in catalog("verify", "--sample", 0, folder=archived).stdout
    assert catalog("add", archived / "other.nc", folder=archived).exit_code == 0
    unproved = "whole, but nothing was solved again"
    verified = catalog("verify", "--sample", 0, folder=archived)
    assert verified.stdout == f"other.nc: {unproved}\nsmall.nc: {unproved}\n"


def test_a_dataset_with_an_endless_title_gets_a_shorter_one_and_without_numerics_id_none(
    archived, other_file, tmp_path
):
    source = tmp_path / "other.nc"
    shutil.copy(other_file, source)
    with Dataset(source, "a") as dataset:
        dataset.title = "x" * 100_000
        numerics_id = dataset.numerics_id
        dataset.delncattr("numerics_id")
    with Dataset(source, "a") as dataset:
        dataset.content_hash = content_hash(source)
    refused = catalog("add", source, folder=archived)
    assert (refused.exit_code, refused.output.count("\n")) == (2, 1)
    assert "numerics_id is missing" in refused.output
    with Dataset(source, "a") as dataset:
        dataset.numerics_id = numerics_id
    with Dataset(source, "a") as dataset:
        dataset.content_hash = content_hash(source)
    assert catalog("add", source, folder=archived).exit_code == 0
    assert all(len(line) < 400 for line in catalog("list", folder=archived).stdout.splitlines())
