"""Files that are changed at random: an answer or one clear sentence, never a traceback or a new file."""

import json
import time
from collections import Counter
from pathlib import Path

import pytest
from click.testing import CliRunner
from end_to_end.conftest import CONTENT, TOML
from end_to_end.mutations import damaged_dataset, edited_dataset, mutated_index, mutated_study
from end_to_end.processes import elastica

from studies import Study
from studies.command_line import main

pytestmark = pytest.mark.long

CATALOGS = sorted((Path(__file__).parents[2] / "catalogs").glob("*.toml"))
TINY = CONTENT | {
    "grid": {"ends": ["clamped-clamped", "clamped-pinned"], "H": [0.05, 0.1, 0.2], "P": [0.5, 1.5, 2.5, 6.0]},
    "outputs": {"eigenvalues": 1, "shapes": 3},
}
LONGEST = 400
"""Characters of a sentence, beside the path of the file."""


def answer(*arguments):
    """Exit status and words of a command in this process, which must not raise."""
    result = CliRunner().invoke(main, [str(argument) for argument in arguments])
    assert result.exception is None or isinstance(result.exception, SystemExit), (arguments, result.exception)
    assert "Traceback" not in result.output
    return result.exit_code, result.output


def is_one_sentence(words, path):
    sentence = words.removeprefix("Error: ").replace(str(path), "FILE")
    return words.startswith("Error: ") and words.count("\n") == 1 and len(sentence) <= LONGEST


def test_mutated_study_files_give_a_plan_or_one_sentence(tmp_path, rng, full, monkeypatch, record_property):
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "small.toml"
    sources = [TOML, *(catalog.read_text() for catalog in CATALOGS)]
    found, slowest, processes = Counter(), 0.0, 20 if full else 2
    for trial in range(10_000 if full else 200):
        text = mutated_study(sources[trial % len(sources)], rng)
        path.write_bytes(text)
        start = time.process_time()
        status, words = answer("plan", path)
        slowest = max(slowest, time.process_time() - start)
        found[status] += 1
        assert status in (0, 2), (text, words)
        assert status == 0 or is_one_sentence(words, path), (text, words)
        if status == 2 and trial % 10 == 0:
            assert answer("run", path) == (status, words), text
        if processes and trial % 50 == 0:
            processes -= 1
            alone = elastica("plan", path)
            assert (alone.returncode, alone.stdout + alone.stderr) == (status, words), text
        assert list(tmp_path.iterdir()) == [path], text
    assert min(found[0], found[2]) > 20
    assert slowest < 30
    record_property("plans and refusals", dict(found))
    print(f"plans {found[0]}, refusals {found[2]}, slowest {slowest:.1f} s")


def test_mutated_indexes_give_an_answer_or_sentences(tmp_path, rng, full, record_property):
    good = (CATALOGS[0].parent / "index.json").read_text()
    entry = json.loads(good)["entries"]["clamped-and-pinned.nc"]
    index = json.loads(good) | {"entries": {f"{name}.nc": entry for name in "abc"}}
    found = Counter()
    (tmp_path / "folder.nc").mkdir()
    for trial in range(20_000 if full else 400):
        text = mutated_index(json.dumps(index, indent=1), rng)
        (tmp_path / "index.json").write_bytes(text.encode("utf-8", "surrogatepass"))
        command = [("list",), ("find", "--state", "U"), ("list", "--json"), ("verify",)][trial % 4]
        status, words = answer("catalog", *command, "--catalog", tmp_path)
        found[command[0], status] += 1
        assert status in (0, 2), (trial, words)
        assert all(len(line) <= 2 * LONGEST for line in words.splitlines() if line[:1] != "["), (trial, words)
        assert all(mark.isprintable() for mark in words.replace("\n", "")), (trial, words)
        assert sorted(path.name for path in tmp_path.iterdir()) == ["folder.nc", "index.json"]
    assert min(found["list", 0], found["list", 2]) > 20
    record_property("answers by command and exit status", {str(key): count for key, count in found.items()})


def test_mutated_datasets_give_an_answer_or_one_sentence(computed, tmp_path, rng, full, record_property):
    whole = computed(Study.from_dict(TINY))
    good = whole.read_bytes()
    path, out = tmp_path / "damaged.nc", tmp_path / "out"
    out.mkdir()
    found = Counter()
    for trial in range(2_000 if full else 200):
        if trial % 2:
            path.write_bytes(damaged_dataset(good, rng))
        else:
            edited_dataset(whole, path, rng)
        check = ("check", path, "--sample", 3 if trial % 8 == 0 else 0)
        merge = ("merge", whole, path, "-o", out / "merged.nc")
        plot = ("plot", path, "-o", out / "plot.png")
        # A few are drawn: a picture takes a second.
        command = plot if trial % 20 in (8, 19) else merge if trial // 2 % 2 else check
        status, words = answer(*command)
        found[command[0], status] += 1
        assert status in (0, 2), (trial, words)
        if status == 2 and command != check:
            assert is_one_sentence(words, path), (trial, words)
        if status == 2 or command == check:
            assert list(out.iterdir()) == []
        for written in out.iterdir():
            written.unlink()
        path.unlink()
    assert found["check", 2] > 20
    record_property("answers by command and exit status", {str(key): count for key, count in found.items()})
    print(f"answers by command and exit status: {dict(found)}")
