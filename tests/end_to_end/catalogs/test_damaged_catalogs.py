"""What is gone, damaged or forged in a catalog is named, never repaired, and hides nothing else."""

import json
import shutil

import pytest
from end_to_end.catalogs.command import catalog
from netCDF4 import Dataset

import studies
from studies.archive import keeping
from studies.archive.catalog import Catalog
from studies.archive.keeping import _write
from studies.store.content import content_hash


def change_a_value(path):
    with Dataset(path, "a") as dataset:
        dataset.variables["energy"][0, 0, 3, 0] += 1e-12


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
        "sha256": keeping._sha256(path),
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
