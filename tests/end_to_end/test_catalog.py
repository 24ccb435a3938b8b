"""The archive as a user keeps it: datasets go in, are found again, and nothing is lost or hidden."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from threading import Thread

import numpy as np
import pytest
from click.testing import CliRunner
from end_to_end.processes import elastica, start
from netCDF4 import Dataset

import studies
from studies import Study
from studies.archive import archive
from studies.archive.archive import _write
from studies.archive.catalog import Catalog
from studies.command_line import main
from studies.running.lock import one_at_a_time
from studies.store.content import content_hash

CATALOGS = Path(__file__).parents[2] / "catalogs"
SHIPPED = CATALOGS / "clamped-and-pinned.nc"


def catalog(command, *arguments, folder=None):
    where = () if folder is None else ("--catalog", folder)
    return CliRunner().invoke(main, ["catalog", command, *map(str, (*arguments, *where))])


@pytest.fixture
def archived(tmp_path, dataset_file):
    """A catalog with the small study, and its file."""
    folder = tmp_path / "archive"
    folder.mkdir()
    shutil.copy(dataset_file, tmp_path / "small.nc")
    assert catalog("add", tmp_path / "small.nc", folder=folder).exit_code == 0
    return folder


@pytest.fixture(scope="session")
def other_file(computed):
    """A dataset of other ends, loads and states."""
    content = {
        "study": {"name": "other"},
        "grid": {"ends": ["pinned-pinned"], "H": [0.1], "shortening": [0.03, 0.04]},
        "states": {"names": ["U"]},
    }
    return computed(Study.from_dict(content))


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


def change_a_value(path):
    with Dataset(path, "a") as dataset:
        dataset.variables["energy"][0, 0, 3, 0] += 1e-12


def test_a_dataset_whose_values_changed_is_not_taken_in(archived, other_file, tmp_path):
    changed = tmp_path / "changed.nc"
    shutil.copy(other_file, changed)
    with Dataset(changed, "a") as dataset:
        dataset.variables["P"][:] *= 1.001
    refused = catalog("add", changed, folder=archived)
    assert (refused.exit_code, "the values are not those that were written" in refused.output) == (2, True)
    assert changed.exists()


def remove_units(path):
    with Dataset(path, "a") as dataset:
        dataset.variables["energy"].delncattr("units")


def flip_a_bit(path):
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)


@pytest.mark.parametrize(
    ("harm", "message"),
    [
        (lambda path: path.unlink(), "the file is gone"),
        (change_a_value, "its hash differs"),
        (flip_a_bit, "its hash differs"),
        (remove_units, "its hash differs"),
        (lambda path: path.write_bytes(b""), "its hash differs"),
    ],
)
def test_what_is_gone_or_changed_is_reported_and_never_repaired(archived, harm, message):
    index = (archived / "index.json").read_text()
    harm(archived / "small.nc")
    result = catalog("verify", "--sample", 0, folder=archived)
    assert (result.exit_code, result.stdout) == (2, "")
    assert "problem: small.nc: the file is" in result.stderr
    assert message in result.stderr
    assert (archived / "index.json").read_text() == index


def test_list_tells_at_a_look_that_a_file_is_gone_or_has_another_size(archived):
    path = archived / "small.nc"
    path.write_bytes(path.read_bytes()[:-1])
    assert f"{path}: the file is changed" in catalog("list", folder=archived).stderr
    path.unlink()
    listed = catalog("list", "--json", folder=archived)
    assert f"{path}: the file is gone" in listed.stderr
    assert json.loads(listed.stdout)[0]["file"] == "gone"


def test_a_dataset_that_is_gone_is_put_back_by_adding_it_again(archived, dataset_file, tmp_path):
    (archived / "small.nc").unlink()
    shutil.copy(dataset_file, tmp_path / "renamed.nc")
    assert catalog("add", tmp_path / "renamed.nc", folder=archived).stdout == f"{archived / 'small.nc'}\n"
    assert catalog("verify", "--sample", 0, folder=archived).exit_code == 0


def test_verify_solves_a_sample_again_and_looks_at_the_attributes(archived):
    """Damage that was there when the dataset was added."""
    path = archived / "small.nc"
    with Dataset(path, "a") as dataset:
        dataset.variables["shortening"][:] *= 1.001
        dataset.variables["energy"].units = "J"
        dataset.Conventions = "none"
    with Dataset(path, "a") as dataset:
        dataset.content_hash = content_hash(path)
    entry = Catalog.read(archived).entries["small.nc"]
    changed = {
        "content_hash": content_hash(path),
        "sha256": archive._sha256(path),
        "bytes": path.stat().st_size,
    }
    _write(Catalog(archived, {"small.nc": entry.model_copy(update=changed)}))
    result = catalog("verify", "--sample", 20, folder=archived)
    assert result.exit_code == 2
    assert "shortening cannot be found again" in result.stderr
    assert "energy has not the units of this format" in result.stderr
    assert "Conventions does not name CF" in result.stderr


def test_a_dataset_of_older_numerics_is_still_good_and_says_so(tmp_path, dataset_file):
    old, folder = tmp_path / "old.nc", tmp_path / "archive"
    folder.mkdir()
    shutil.copy(dataset_file, old)
    with Dataset(old, "a") as dataset:
        dataset.setncatts({"numerics_version": 1, "numerics_id": "of then"})
    with Dataset(old, "a") as dataset:
        dataset.content_hash = content_hash(old)
    report, problems = studies.check(old, sample=20)
    assert (problems, report[-1]) == ([], "  good")
    assert any(line.endswith("computed by version 1") for line in report)
    assert catalog("add", old, folder=folder).exit_code == 0
    assert catalog("verify", folder=folder).stdout == "old.nc: good\n"
    assert Catalog.read(folder).entries["old.nc"].numerics_id == "of then"


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("{", "this is no index of a catalogue"),
        ("[]", "this is no index of a catalogue"),
        ('{"format_version": 1, "entries": {"a.nc": {}}}', "entries.a.nc.title: Field required"),
        ('{"format_version": 1, "entries": {"../a.nc": {}}}', "no name of a file"),
        ('{"format_version": 2, "entries": {}}', "version 2 of the index is newer than 1"),
        ("[" * 10**5, "this is no index of a catalogue"),
    ],
)
@pytest.mark.parametrize("command", ["list", "find", "verify", "add"])
def test_a_damaged_index_is_one_sentence_and_stays_as_it_is(
    archived, dataset_file, tmp_path, command, content, message
):
    (archived / "index.json").write_text(content)
    copy = tmp_path / "copy.nc"
    shutil.copy(dataset_file, copy)
    result = catalog(command, *([copy] if command == "add" else []), folder=archived)
    assert (result.exit_code, result.stderr.count("\n")) == (2, 1)
    assert message in result.stderr
    assert (archived / "index.json").read_text() == content
    assert copy.exists()


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


def test_adds_at_the_same_time_lose_no_entry(tmp_path, other_file):
    folder = tmp_path / "catalogs"
    folder.mkdir()
    names = [f"{number}.nc" for number in range(2)]
    for number, name in enumerate(names):
        shutil.copy(other_file, tmp_path / name)
        with Dataset(tmp_path / name, "a") as dataset:
            dataset.variables["P"][0, 0, 0, 0] = number
        with Dataset(tmp_path / name, "a") as dataset:
            dataset.content_hash = content_hash(tmp_path / name)
    processes = [start("catalog", "add", name, cwd=tmp_path) for name in names]
    ends = [process.communicate(timeout=200) for process in processes]
    assert [process.returncode for process in processes] == [0] * len(names), ends
    assert sorted(Catalog.read(folder).entries) == names
    assert sorted(path.name for path in folder.iterdir()) == [*names, "index.json"]


def test_an_add_reads_the_index_when_the_one_before_has_written_it(archived, other_file, tmp_path):
    shutil.copy(other_file, tmp_path / "other.nc")
    before = Catalog.read(archived)
    thread = Thread(target=archive.add, args=(archived, tmp_path / "other.nc"))
    with one_at_a_time(archived / "index.lock", 1):
        thread.start()
        thread.join(1.5)
        assert list(Catalog.read(archived).entries) == ["small.nc"]
        _write(Catalog(archived, before.entries | {"first.nc": before.entries["small.nc"]}))
    thread.join(60)
    assert sorted(Catalog.read(archived).entries) == ["first.nc", "other.nc", "small.nc"]


def test_a_lock_that_is_never_released_is_named(archived, other_file, tmp_path, monkeypatch):
    monkeypatch.setattr(archive, "PATIENCE", 0.1)
    shutil.copy(other_file, tmp_path / "other.nc")
    lock = archived / "index.lock"
    lock.write_text(json.dumps({"host": "far-away", "boot": "b", "pid": 7, "started": 1.7e9}))
    refused = catalog("add", tmp_path / "other.nc", folder=archived)
    assert (refused.exit_code, refused.output.count("\n")) == (2, 1)
    assert f"{lock}: another process holds this lock" in refused.output
    lock.unlink()
    assert catalog("add", tmp_path / "other.nc", folder=archived).exit_code == 0


@pytest.mark.parametrize("moment", ["_place", "_write", "_take_away"])
def test_an_add_that_stops_half_way_loses_nothing_and_can_be_repeated(
    archived, other_file, tmp_path, monkeypatch, moment
):
    source = tmp_path / "other.nc"
    shutil.copy(other_file, source)

    def stop(*arguments, **options):
        raise OSError(28, "No space left on device", str(archived))

    with monkeypatch.context() as broken:
        broken.setattr(archive, moment, stop)
        stopped = catalog("add", source, folder=archived)
    assert (stopped.exit_code, "No space left" in stopped.output) == (2, True)
    assert source.read_bytes() == other_file.read_bytes()
    assert not list(archived.glob("*.lock"))
    assert catalog("verify", "--sample", 0, folder=archived).exit_code == 0
    again = catalog("add", source, folder=archived)
    assert again.exit_code == (2 if moment == "_take_away" else 0), again.output
    assert (archived / "other.nc").read_bytes() == other_file.read_bytes()
    assert sorted(Catalog.read(archived).entries) == ["other.nc", "small.nc"]
    assert catalog("verify", "--sample", 0, folder=archived).exit_code == 0


def test_on_another_file_system_the_file_is_copied_and_proved(archived, other_file, tmp_path, monkeypatch):
    def far(*arguments):
        raise OSError(18, "Invalid cross-device link")

    monkeypatch.setattr(os, "link", far)
    source = tmp_path / "other.nc"
    shutil.copy(other_file, source)
    with monkeypatch.context() as broken:
        broken.setattr(shutil, "copyfile", lambda a, b: Path(b).write_bytes(Path(a).read_bytes()[:-1]))
        refused = catalog("add", source, folder=archived)
    assert (refused.exit_code, "this is not what was read before" in refused.output) == (2, True)
    assert sorted(path.name for path in archived.iterdir()) == ["index.json", "small.nc"]
    assert catalog("add", source, folder=archived).exit_code == 0
    assert not source.exists()
    assert (archived / "other.nc").read_bytes() == other_file.read_bytes()


def test_a_file_that_lies_in_the_folder_gets_its_entry_where_it_is(archived, other_file):
    shutil.copy(other_file, archived / "other.nc")
    assert "other.nc: not in the index" in catalog("verify", "--sample", 0, folder=archived).stdout
    assert catalog("add", archived / "other.nc", folder=archived).exit_code == 0
    unproved = "whole, but nothing was solved again"
    verified = catalog("verify", "--sample", 0, folder=archived)
    assert verified.stdout == f"other.nc: {unproved}\nsmall.nc: {unproved}\n"


def test_the_archived_chart_is_good_small_and_that_of_its_study():
    result = catalog("verify", "--sample", 40, folder=CATALOGS)
    assert (result.exit_code, result.stdout) == (0, "clamped-and-pinned.nc: good\n"), result.stderr
    assert SHIPPED.stat().st_size < 500_000
    entry = Catalog.read(CATALOGS).entries[SHIPPED.name]
    # Once the numerics change, it has to be computed and added anew: then its sample is solved again.
    study = Study.from_toml(CATALOGS / "clamped-and-pinned.toml")
    assert (study.study_id, study.numerics_id) == (entry.study_id, entry.numerics_id)


@pytest.mark.parametrize("far", [False, True])
def test_a_file_that_takes_the_place_of_the_one_added_is_not_removed(
    archived, other_file, tmp_path, monkeypatch, far
):
    source = tmp_path / "other.nc"
    shutil.copy(other_file, source)
    if far:

        def no_link(old, new):
            if Path(new).parent == archived:
                raise OSError(18, "Invalid cross-device link")
            link(old, new)

        link = os.link
        monkeypatch.setattr(os, "link", no_link)

    def replace(catalog):
        (tmp_path / "newer").write_text("a day of work")
        os.replace(tmp_path / "newer", source)
        _write(catalog)

    monkeypatch.setattr(archive, "_write", replace)
    added = catalog("add", source, folder=archived)
    assert added.exit_code == 0, added.output
    assert source.read_text() == "a day of work"
    assert "another file has taken this place" in added.stderr
    assert (archived / "other.nc").read_bytes() == other_file.read_bytes()
    assert [path.name for path in tmp_path.glob(".*")] == []
    assert catalog("verify", "--sample", 0, folder=archived).exit_code == 0


def test_what_is_added_is_what_was_read(archived, other_file, tmp_path, monkeypatch):
    """Whenever another file comes in between, nothing is added and nothing is removed."""
    source = tmp_path / "other.nc"
    index = (archived / "index.json").read_text()
    for name, original in (("describe", archive.describe), ("_name", archive._name)):
        shutil.copy(other_file, source)

        def replacing(*arguments, original=original):
            answer = original(*arguments)
            shutil.copy(SHIPPED, tmp_path / "newer")
            os.replace(tmp_path / "newer", source)
            return answer

        with monkeypatch.context() as patched:
            patched.setattr(archive, name, replacing)
            refused = catalog("add", source, folder=archived)
        assert (refused.exit_code, "add it again" in refused.output) == (2, True), refused.output
        assert source.read_bytes() == SHIPPED.read_bytes()
        assert sorted(path.name for path in archived.iterdir()) == ["index.json", "small.nc"]
        assert (archived / "index.json").read_text() == index


def test_a_name_that_appears_in_the_folder_is_not_overwritten(archived, other_file, tmp_path, monkeypatch):
    source = tmp_path / "other.nc"
    shutil.copy(other_file, source)

    def appearing(*arguments, original=archive._name):
        name = original(*arguments)
        (archived / name).write_text("a day of work")
        return name

    monkeypatch.setattr(archive, "_name", appearing)
    refused = catalog("add", source, folder=archived)
    assert (refused.exit_code, refused.output.count("\n")) == (2, 1)
    assert (archived / "other.nc").read_text() == "a day of work"
    assert source.exists()


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


BAD_NAMES = [
    "",
    ".",
    "..",
    "../a.nc",
    "a\0.nc",
    "\ud800.nc",
    "x" * 300 + ".nc",
    "a",
    "index.json",
    "/etc/passwd",
]
BAD_CONTENT = [
    {"solve": {}},
    {"solve": {"method": "magic"}},
    {"solve": {"method": "chain", "stiffness": [float("nan")]}},
    {"bytes": 10**399},
    {"bytes": -1},
    {"title": None},
    {"title": "\ud800"},
    {"title": "x" * 100_000},
    {"ends": ["clamped-free"]},
    {"H": {"start": float("inf"), "stop": 1, "num": 1}},
    {"H": {"start": 0, "stop": 1, "num": 1e400}},
    {"P": None},
    {"shortening": {"start": 0, "stop": 1, "num": 1}},
    {"extra": 1},
]


@pytest.mark.parametrize("command", ["list", "find", "verify", "add"])
def test_a_bad_entry_is_named_and_hides_no_other(archived, other_file, tmp_path, command):
    index = json.loads((archived / "index.json").read_text())
    good = index["entries"]["small.nc"]
    bad = {name: good for name in BAD_NAMES} | {
        f"{number}.nc": good | content for number, content in enumerate(BAD_CONTENT)
    }
    text = json.dumps(index | {"entries": bad | {"small.nc": good}})
    twice = text.replace(
        '"entries": {', '"entries": {"twice.nc": {}, "twice.nc": {}, "in.nc": {"a": 1, "a": 2}, '
    )
    for content, named in ((text, len(bad)), (twice, len(bad) + 2)):
        (archived / "index.json").write_text(content)
        arguments = {"add": [other_file], "verify": ["--sample", 0]}.get(command, [])
        result = catalog(command, *arguments, folder=archived)
        assert result.exit_code == 2
        assert "Traceback" not in result.output
        if command == "add":
            assert result.output.count("\n") == 1
            assert other_file.exists()
            continue
        assert result.stdout.startswith("small.nc") and result.stdout.count("\n") == 1
        problems = result.stderr.splitlines()
        assert len(problems) == named, result.stderr
        assert all(line.startswith("problem: ") and len(line) < 400 for line in problems)


def test_texts_of_an_index_cannot_drive_a_terminal(archived):
    index = json.loads((archived / "index.json").read_text())
    entry = index["entries"]["small.nc"]
    wild = "\x1b[2J\r\n\u202e\u2028\x07\x9b"
    entry |= {"title": wild, "date_created": wild, "states": [wild]}
    index["entries"][f"{wild}.nc"] = entry | {"study": wild}
    (archived / "index.json").write_text(json.dumps(index))
    for command in ("list", "find", "verify"):
        result = catalog(command, folder=archived)
        assert all(mark.isprintable() for mark in result.output.replace("\n", "")), result.output
        assert result.stdout.count("\n") == (1 if command == "verify" else 2), result.stdout


STUDIES = sorted(path.stem for path in CATALOGS.glob("*.toml"))


@pytest.mark.parametrize("name", STUDIES)
def test_every_study_plans_what_its_first_lines_promise(name):
    path = CATALOGS / f"{name}.toml"
    head = " ".join(line.lstrip("# ") for line in path.read_text().partition("[study]")[0].splitlines())
    study = Study.from_toml(path)
    assert study.name == name
    assert f"{study.plan().points:,} grid points, about " in head
    assert " on " in head
    assert head.rstrip().endswith("MB.")


def published_minima(dataset):
    alpha = 8 * np.pi**2 * dataset["P"]
    objective = (alpha + 8 * np.pi**2 * dataset["energy"]).where(dataset["stability"] == 0).isel(P=-1, H=0)
    for ends, minima in (
        ("clamped-clamped", [344.8761334891, 346.4956411150]),
        ("pinned-pinned", [340.0304038891]),
    ):
        found = np.sort(objective.sel(ends=ends).values)[: len(minima)]
        assert found == pytest.approx(minima, abs=2e-9)


def verdicts_turn_at_the_transitions(dataset):
    stable = (dataset["stability"] == 0).isel(ends=0, H=0)
    for name, first, last in (("B1", 0, 4), ("U", 5, 12)):
        assert np.flatnonzero(stable.sel(state=name))[[0, -1]].tolist() == [first, last]


PROMISES = {"clnlbeam": published_minima, "near-transitions": verdicts_turn_at_the_transitions}


def test_the_studies_run_and_are_good(tmp_path, full):
    for name in STUDIES if full else PROMISES:
        run = elastica("run", CATALOGS / f"{name}.toml", "--workers", 0, cwd=tmp_path)
        assert run.returncode == 0, run.stderr
        report, problems = studies.check(tmp_path / f"{name}.nc", sample=10)
        assert problems == [], report
        if name in PROMISES:
            with studies.open(tmp_path / f"{name}.nc") as dataset:
                PROMISES[name](dataset)
