"""Files that are damaged at random: an answer or one clear sentence, never a traceback or a new file."""

from click.testing import CliRunner
from end_to_end.conftest import TOML

from studies.command_line import main


def answer(*arguments):
    """Exit status and words of a command in this process, which must not raise."""
    result = CliRunner().invoke(main, [str(argument) for argument in arguments])
    assert result.exception is None or isinstance(result.exception, SystemExit), (arguments, result.exception)
    assert "Traceback" not in result.output
    return result.exit_code, result.output


TOKENS = [
    "nan",
    "inf",
    "-1",
    "0",
    "1e400",
    "true",
    "[]",
    "{}",
    '""',
    "[[",
    "]",
    "=",
    "\n",
    "#",
    "\x00",
    "num",
]


def mutated(text, rng):
    """A study file with some of its characters, words or lines changed."""
    for _ in range(int(rng.integers(1, 4))):
        place = int(rng.integers(len(text)))
        end = place + int(rng.integers(12))
        kind = rng.integers(4)
        if kind == 0:
            text = text[:place] + text[end:]
        elif kind == 1:
            text = text[:place] + TOKENS[rng.integers(len(TOKENS))] + text[end:]
        elif kind == 2:
            text = text[:place] + chr(int(rng.integers(1, 0x2FF))) + text[place + 1 :]
        else:
            lines = text.splitlines(keepends=True)
            lines.insert(int(rng.integers(len(lines))), lines[rng.integers(len(lines))])
            text = "".join(lines)
    return text


def test_mutated_study_files_give_a_plan_or_one_sentence(tmp_path, rng, full, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "small.toml"
    plans = 0
    for _ in range(10_000 if full else 200):
        text = mutated(TOML, rng)
        path.write_bytes(text.encode("utf-8", "surrogatepass"))
        status, words = answer("plan", path)
        plans += status == 0
        assert status in (0, 2), (text, words)
        assert status == 0 or words.count("\n") == 1, (text, words)
    assert plans > 0
    assert list(tmp_path.iterdir()) == [path]


def test_mutated_datasets_give_an_answer_or_one_sentence(dataset_file, tmp_path, rng, full):
    good = dataset_file.read_bytes()
    path, out = tmp_path / "damaged.nc", tmp_path / "out"
    out.mkdir()
    for trial in range(2_000 if full else 200):
        content = bytearray(good)
        # Half of the damage where the structure of the file is, which is at its beginning and its end.
        place = int(rng.integers(len(good)))
        place = place % 4000 if trial % 4 == 0 else len(good) - 1 - place % 4000 if trial % 4 == 1 else place
        kind = rng.integers(3)
        if kind == 0:
            content[place] ^= 1 << int(rng.integers(8))
        elif kind == 1:
            content[place : place + 64] = bytes(len(content[place : place + 64]))
        else:
            del content[place:]
        path.write_bytes(content)
        check = ("check", path, "--sample", 0)
        merge = ("merge", dataset_file, path, "-o", out / "merged.nc")
        plot = ("plot", path, "-o", out / "plot.png")
        # Every tenth is drawn: a picture takes a second.
        command = plot if trial % 10 == 9 else merge if trial % 2 else check
        status, words = answer(*command)
        assert status in (0, 2), words
        if status == 2 and command[0] != "check":
            assert words.count("\n") == 1, words
            assert list(out.iterdir()) == []
        for written in out.iterdir():
            written.unlink()
