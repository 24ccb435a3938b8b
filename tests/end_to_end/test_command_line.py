"""The `elastica` command as a user types it: real processes, real files."""

import json
import os
import subprocess
import sys

import pytest
from click.testing import CliRunner
from matplotlib.image import imread

from studies.command_line import main


def elastica(*arguments, cwd=None, **kwargs):
    command = [sys.executable, "-c", "from studies.command_line import main; main()", *map(str, arguments)]
    return subprocess.run(command, cwd=cwd, capture_output=True, text=True, timeout=300, **kwargs)


def test_from_study_to_picture(toml, tmp_path):
    plan = elastica("plan", toml)
    assert plan.returncode == 0
    assert "120 grid points" in plan.stdout
    assert list(tmp_path.iterdir()) == [toml]

    run = elastica("run", toml, "--workers", 2, cwd=tmp_path)
    assert run.returncode == 0, run.stderr
    assert run.stdout.startswith("small.nc: 120 grid points")
    again = elastica("run", toml, cwd=tmp_path)
    assert (again.returncode, "this study is done" in again.stdout) == (0, True)

    check = elastica("check", "small.nc", "--sample", 10, cwd=tmp_path)
    assert (check.returncode, check.stderr) == (0, "")
    assert check.stdout.endswith("good\n")

    plot = elastica("plot", "small.nc", cwd=tmp_path)
    assert (plot.returncode, plot.stdout) == (0, "small.png\n")
    assert imread(tmp_path / "small.png").std() > 0.1
    assert sorted(p.name for p in tmp_path.iterdir()) == ["small.nc", "small.png", "small.toml"]


def test_solve_in_words_and_in_json():
    words = elastica("solve", "--state", "U", "--P", 2.5, "--H", 0.1)
    assert words.returncode == 0
    assert "stability         stable" in words.stdout
    answer = json.loads(elastica("solve", "--state", "U", "--P", 2.5, "--H", 0.1, "--json").stdout)
    assert answer["eigenvalues"][0] == pytest.approx(24.8282985, abs=5e-8)
    assert (answer["status"], answer["index"]) == ("solved", 0)
    pulled = elastica("solve", "--state", "U", "--P", 0, "--H", 0.1, "--json").stdout
    assert "Infinity" not in pulled
    assert "NaN" not in pulled
    nowhere = json.loads(elastica("solve", "--state", "Ua", "--P", 1.5, "--H", 0.1, "--json").stdout)
    assert (nowhere["status"], nowhere["curvature"]) == ("no_equilibrium", None)


def test_solving_one_state_loads_nothing_heavy():
    code = (
        "import sys; from click.testing import CliRunner; from studies.command_line import main;"
        "r = CliRunner().invoke(main, 'solve --state U --P 2.5 --H 0.1'.split()); assert r.exit_code == 0;"
        "print([m for m in ('dask', 'xarray', 'netCDF4', 'matplotlib', 'pydantic') if m in sys.modules])"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "[]"


def invoke(*arguments):
    return CliRunner().invoke(main, [str(argument) for argument in arguments])


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("solve", "--state", "Q", "--P", 1, "--H", 0.1), "state = 'Q' is not known"),
        (("solve", "--state", "U", "--P", "nan", "--H", 0.1), "P = nan is not possible; give a load from 0"),
        (("solve", "--state", "U", "--P", 1, "--H", 0), "H = 0 is not possible; give a half gap above 0"),
        (
            ("solve", "--state", "U", "--P", 1, "--H", 0.1, "--ends", "free-free"),
            'write "A-B" or "A/B"',
        ),
        (("solve", "--state", "U", "--P", "x", "--H", 0.1), "'x' is not a valid float"),
        (
            ("solve", "--state", "U", "--P", 1, "--shortening", 0.1, "--H", 0.1),
            "give either --P or --shortening",
        ),
        (("solve", "--state", "U", "--H", 0.1), "give either --P or --shortening"),
        (("solve", "--state", "U", "--P", 1), "Missing option '--H'"),
        (("solve", "--state", "U", "--shortening", -0.1, "--H", 0.1), "an approach of the ends from 0 to 2"),
        (("solve", "--state", "U" * 51, "--P", 1, "--H", 0.1), "at most 50"),
        (("solve", "--state", "U", "--P", 1, "--H", 0.1, "--ends", "-1/2"), "spring constant k >= 0"),
        (("states", "--max-contacts", 11), "use a whole number from 0 to 10"),
        (("states", "--ends", "0.3/-2.5"), "spring constant k >= 0"),
        (("states", "--P", 6), "--H is missing"),
        (("states", "--H", 0.1), "give either --P or --shortening"),
        (("states", "--P", 6, "--shortening", 0.1, "--H", 0.1), "give either --P or --shortening"),
        (("states", "--shortening", 2.5, "--H", 0.1), "an approach of the ends from 0 to 2"),
        (("plan", "missing.toml"), "missing.toml: No such file"),
        (("run", "missing.toml"), "missing.toml: No such file"),
        (("check", "missing.nc"), "missing.nc: there is no such file"),
        (("plot", "missing.nc"), "missing.nc: there is no such file"),
        (("plot", "missing.nc", "-o", "picture.doc"), "use .png, .pdf or .svg"),
        (("plot", "missing.nc", "-o", "nowhere/picture.png"), "does not exist"),
    ],
)
def test_bad_input_is_one_sentence_and_exit_status_two(arguments, message, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = invoke(*arguments)
    assert result.exit_code == 2
    assert message in result.output
    assert "Traceback" not in result.output
    assert list(tmp_path.iterdir()) == []


def test_solve_at_a_shortening_gives_the_load():
    answer = json.loads(invoke("solve", "--state", "U", "--shortening", 0.03, "--H", 0.1, "--json").stdout)
    back = json.loads(invoke("solve", "--state", "U", "--P", answer["P"], "--H", 0.1, "--json").stdout)
    assert back["shortening"] == pytest.approx(0.03, rel=1e-9)
    assert (answer["control"], back["control"]) == ("shortening", "P")
    assert "periods" not in answer


def test_further_periods_are_printed_where_there_are_any():
    from elastica import find_states

    found = find_states(P=12.0, H=0.05, max_contacts=1)
    root = next(name for name in found.state if ":" in name)
    answer = json.loads(invoke("solve", "--state", root, "--P", 12, "--H", 0.05, "--json").stdout)
    assert answer["status"] == "solved"
    assert sum(answer["periods"]) > 0


def test_states_are_listed_by_name_or_at_a_point():
    import elastica as mechanics

    ends = ("--ends", "pinned-pinned", "--max-contacts", 1)
    names = mechanics.states("pinned-pinned", 1)
    assert invoke("states", *ends).output.split() == names
    assert json.loads(invoke("states", *ends, "--json").output) == names
    found = mechanics.find_states(P=2.0, H=0.1, ends="pinned-pinned", max_contacts=1)
    assert invoke("states", *ends, "--P", 2, "--H", 0.1).output == f"{found}\n"
    rows = json.loads(invoke("states", *ends, "--P", 2, "--H", 0.1, "--json").output)
    assert [row["state"] for row in rows] == found.state.tolist()
    assert rows[0]["stability"] == "stable"
    assert rows[0]["energy"] == found.energy[0]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("num = 12", "num = 12.5", "grid.P.num = 12.5"),
        ("[outputs]", "[output]", "unknown key output"),
        ("0.04", "nan", "grid.H.start"),
        ("[study]", "[study", "this is no TOML file"),
        ("clamped-pinned", "clamped-free", "'clamped-free' is not known"),
    ],
)
def test_a_bad_study_writes_nothing(toml, tmp_path, monkeypatch, old, new, message):
    monkeypatch.chdir(tmp_path)
    toml.write_text(toml.read_text().replace(old, new))
    for command in ("plan", "run"):
        result = invoke(command, toml)
        assert (result.exit_code, "Traceback" in result.output) == (2, False)
        assert message in result.output
    assert list(tmp_path.iterdir()) == [toml]


@pytest.mark.parametrize("content", [b"", b"CDF\x01garbage", b"\x89HDF\r\n\x1a\n" + bytes(500)])
@pytest.mark.parametrize("command", ["check", "plot"])
def test_files_that_are_not_ours(tmp_path, command, content):
    path = tmp_path / "foreign.nc"
    path.write_bytes(content)
    result = invoke(command, path)
    assert (result.exit_code, "Traceback" in result.output) == (2, False)
    assert str(path) in result.output


def test_a_truncated_dataset_is_reported(dataset_file, tmp_path):
    path = tmp_path / "short.nc"
    path.write_bytes(dataset_file.read_bytes()[:-5000])
    for command in ("check", "plot"):
        result = invoke(command, path)
        assert (result.exit_code, "Traceback" in result.output) == (2, False)


def test_terminate_stops_cleanly_and_the_same_command_goes_on(tmp_path, dataset_file):
    """SIGTERM (walltime) keeps what is computed."""
    import signal
    import time

    from end_to_end.conftest import TOML

    toml = tmp_path / "small.toml"
    toml.write_text(TOML.replace("num = 12", "num = 2000").replace("eigenvalues = 3", "eigenvalues = 30"))
    code = "from studies.command_line import main; main()"
    process = subprocess.Popen(
        [sys.executable, "-c", code, "run", str(toml), "--workers", "0"],
        cwd=tmp_path,
        stderr=subprocess.PIPE,
        text=True,
    )
    shards = tmp_path / "small.nc.shards"
    deadline = time.monotonic() + 120
    while time.monotonic() < deadline and not list(shards.glob("0*.nc")):
        time.sleep(0.1)
    process.send_signal(signal.SIGTERM)
    _, stderr = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "the same command goes on" in stderr
    assert not list(shards.glob(".*"))
    assert list(shards.glob("0*.nc"))
    assert not (tmp_path / "small.nc").exists()


def test_read_only_folder_is_refused(toml, tmp_path, monkeypatch):
    monkeypatch.setattr(os, "access", lambda path, mode, **_: mode != os.W_OK)
    result = invoke("run", toml, "-o", tmp_path / "small.nc")
    assert result.exit_code == 2
    assert "cannot be written to" in result.output
    assert list(tmp_path.iterdir()) == [toml]
