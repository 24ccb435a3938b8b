"""Whatever comes in between while a dataset enters a catalog, nothing is lost."""

import json
import os
import shutil
from pathlib import Path
from threading import Thread

import pytest
from end_to_end.catalogs.command import SHIPPED, catalog
from end_to_end.processes import start
from netCDF4 import Dataset

from studies.archive import keeping
from studies.archive.catalog import Catalog
from studies.archive.keeping import _write
from studies.running.lock import one_at_a_time
from studies.store.content import content_hash


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
    thread = Thread(target=keeping.add, args=(archived, tmp_path / "other.nc"))
    with one_at_a_time(archived / "index.lock", 1):
        thread.start()
        thread.join(1.5)
        assert list(Catalog.read(archived).entries) == ["small.nc"]
        _write(Catalog(archived, before.entries | {"first.nc": before.entries["small.nc"]}))
    thread.join(60)
    assert sorted(Catalog.read(archived).entries) == ["first.nc", "other.nc", "small.nc"]


def test_a_lock_that_is_never_released_is_named(archived, other_file, tmp_path, monkeypatch):
    monkeypatch.setattr(keeping, "PATIENCE", 0.1)
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
        broken.setattr(keeping, moment, stop)
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

    monkeypatch.setattr(keeping, "_write", replace)
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
    for name, original in (("describe", keeping.describe), ("_name", keeping._name)):
        shutil.copy(other_file, source)

        def replacing(*arguments, original=original):
            answer = original(*arguments)
            shutil.copy(SHIPPED, tmp_path / "newer")
            os.replace(tmp_path / "newer", source)
            return answer

        with monkeypatch.context() as patched:
            patched.setattr(keeping, name, replacing)
            refused = catalog("add", source, folder=archived)
        assert (refused.exit_code, "add it again" in refused.output) == (2, True), refused.output
        assert source.read_bytes() == SHIPPED.read_bytes()
        assert sorted(path.name for path in archived.iterdir()) == ["index.json", "small.nc"]
        assert (archived / "index.json").read_text() == index


def test_a_name_that_appears_in_the_folder_is_not_overwritten(archived, other_file, tmp_path, monkeypatch):
    source = tmp_path / "other.nc"
    shutil.copy(other_file, source)

    def appearing(*arguments, original=keeping._name):
        name = original(*arguments)
        (archived / name).write_text("a day of work")
        return name

    monkeypatch.setattr(keeping, "_name", appearing)
    refused = catalog("add", source, folder=archived)
    assert (refused.exit_code, refused.output.count("\n")) == (2, 1)
    assert (archived / "other.nc").read_text() == "a day of work"
    assert source.exists()
