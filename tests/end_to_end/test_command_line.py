"""The `elastica` command as a user types it: real processes, real files."""

import json
import os
import subprocess
import sys
from itertools import product

import pytest
from click.testing import CliRunner
from matplotlib.image import imread

import studies
from studies import Study, StudyError
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


def invoke_with(encoding, *arguments):
    return CliRunner(charset=encoding).invoke(main, [str(argument) for argument in arguments])


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
        (("solve", "--state", "U", "--P", "x", "--H", 0.1), "'x' is not a number; write one such as 0.1"),
        (("solve", "--state", "u", "--P", 1, "--H", 0.1), "state = 'u' is not known (did you mean 'U'?)"),
        (("solve", "--state", "U", "--P", "1,x", "--H", 0.1), "'--P': 'x' is not a number"),
        (("solve", "--state", "U", "--P", 1, "x", "--H", 0.1), "'--P': 'x' is not a number"),
        (("solve", "--state", "U", "--P", ",", "--H", 0.1), "'--P': a value is missing"),
        (("solve", "--state", "--P", 1), "--state needs a value; write it before --P"),
        (("solve", "--eigenvalues", 1, 2), "--eigenvalues takes one value; leave out '2'"),
        (("solve", "--eigenvalues", 1, "--eigenvalues", 2), "--eigenvalues is given twice; give it once"),
        (("solve", "--method", "Exact"), "'Exact' is not known (did you mean 'exact'?); use exact, chain"),
        (("plot", "x.nc", "--kind", "shape"), "'shape' is not known (did you mean 'shapes'?)"),
        (("plot", "x.nc", "--kind", "bifurcation", "--H", "0.1,0.2"), "more than one value; give one here"),
        (("plot", "x.nc", "--kind", "bifurcation", "--H", "0.1", "0.2"), "takes one value; leave out '0.2'"),
        (("catalog", "find", "--P", "1,2"), "'1,2' is more than one value; give one here"),
        (("solve", "--eigenvalues", "two"), "'two' is not a whole number; write one such as 4"),
        (("states", "--max-contacts", 1.5), "'1.5' is not a whole number; write one such as 4"),
        (("run", "x.toml", "--scheduler", "host"), "'host' is no address; write one such as tcp://host:8786"),
        (("sovle",), "No such command 'sovle'. Did you mean 'solve'?"),
        (("solve", "--stat", "U"), "No such option '--stat'. Did you mean '--state'?"),
        (("run", "x.toml", "-o", r"C:\x.nc"), "this is a path of Windows; here folders are divided by /"),
        (("merge", "x.nc", "-o", r"out\x.nc"), "this is a path of Windows; here folders are divided by /"),
        (("plot", "x.nc", "-o", "C:/x.png"), "this is a path of Windows; here folders are divided by /"),
        (
            ("solve", "--state", "U", "--P", 1, "--shortening", 0.1, "--H", 0.1),
            "give either --P or --shortening",
        ),
        (("solve", "--state", "U", "--H", 0.1), "give either --P or --shortening"),
        (("solve", "--state", "U", "--P", 1), "Missing option '--H'"),
        (
            ("solve", "--state", "U", "--shortening", -0.1, "--H", 0.1),
            "an approach of the ends from 0 to 2",
        ),
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


def test_several_values_after_commas_spaces_or_the_option_again():
    point = ("solve", "--state", "U", "U-", "--H", 0.1, "--json")
    after_commas = invoke(*point, "--P", "2.5, 4.5").output
    answers = json.loads(after_commas)
    assert [(answer["state"], answer["P"]) for answer in answers] == list(product(("U", "U-"), (2.5, 4.5)))
    assert [answer["stability"] for answer in answers] == [
        "stable",
        "unstable",
        "not_solved",
        "unstable_third_order",
    ]
    assert invoke(*point, "--P", 2.5, 4.5).output == after_commas
    assert invoke(*point, "--P", 2.5, "--P", 4.5).output == after_commas
    assert invoke(*point, "--P=2.5", "4.5").output == after_commas
    one = invoke("solve", "--state", "U", "--H", 0.1, "--P", 2.5).output
    two = invoke("solve", "--state", "U", "--H", 0.1, "--P", 2.5, 4.5).output
    assert two.startswith(one)
    assert two.count("stability") == 2


def test_several_values_of_states_and_transitions():
    ends = ("--ends", "clamped-clamped", "pinned-pinned")
    names = invoke("states", *ends, "--max-contacts", 1).output.split()
    assert len(names) == len(set(names))
    assert {"U-", "Ua-"} < set(names)
    rows = json.loads(invoke("states", *ends, "--P", "2,6", "--H", 0.1, "--json").output)
    assert {(row["ends"], row["P"]) for row in rows} == set(product(ends[1:], (2.0, 6.0)))
    assert invoke("states", *ends, "--P", "2,6", "--H", 0.1).output.count("clamped-clamped") == 2
    found = invoke("transitions", "--state", "U,UD", *ends, "--H", "0.05", 0.1, "--json").output
    rows = json.loads(found)
    asked = product(("U", "UD"), ends[1:], (0.05, 0.1))
    assert {(row["state"], row["ends"], row["H"]) for row in rows} == set(asked)


def test_values_of_an_option_do_not_swallow_the_file(dataset_file, tmp_path):
    picture = tmp_path / "shapes.png"
    options = ("--kind", "shapes", "--H", 0.1, "--ends", "clamped-clamped")
    for arguments in ((*options, "--P", 2, 4, dataset_file), (dataset_file, *options, "--P", "2,4")):
        result = invoke("plot", *arguments, "-o", picture)
        assert result.exit_code == 0, result.output


def test_a_wall_that_is_never_touched_is_told():
    result = invoke("solve", "--state", "U", "--P", 2.5, "--H", 10)
    assert result.exit_code == 0
    assert "H = 10: such a wall is never touched; H is half the gap over the length" in result.stderr
    assert "no_equilibrium" in result.stdout


@pytest.mark.parametrize("output", ["/", ".", "..", ""])
def test_a_folder_is_no_output(toml, tmp_path, monkeypatch, output):
    monkeypatch.chdir(tmp_path)
    result = invoke("run", toml, "-o", output)
    assert (result.exit_code, "this is a folder; name a file" in result.output) == (2, True)
    assert list(tmp_path.iterdir()) == [toml]


def test_misspelled_names_of_a_dataset_are_asked_after(dataset_file, tmp_path):
    for show, name in (("prefered", "preferred"), ("Energy", "energy")):
        result = invoke("plot", dataset_file, "--show", show, "-o", tmp_path / "x.png")
        assert (result.exit_code, f"(did you mean '{name}'?)" in result.output) == (2, True)


def test_a_path_of_windows_is_refused_in_python_too(toml, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(StudyError, match="this is a path of Windows; here folders are divided by /"):
        studies.run(Study.from_toml(toml), "C:\\x.nc", workers=0)
    assert list(tmp_path.iterdir()) == [toml]


KINDS = {"a.toml": b"[study]\n", "b.nc": b"\x89HDF\r\n\x1a\n", "c.nc": b"CDF\x01", "d.png": b"\x89PNG"}


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("plot", "a.toml"), "a.toml: this is a study, not a dataset; compute it: elastica run a.toml"),
        (("check", "a.toml"), "a.toml: this is a study, not a dataset; compute it: elastica run a.toml"),
        (("merge", "a.toml", "-o", "x.nc"), "a.toml: this is a study, not a dataset; compute it"),
        (
            ("catalog", "add", "a.toml", "--catalog", "."),
            "a.toml: this is a study, not a dataset; compute it",
        ),
        (("run", "b.nc"), "b.nc: this is a dataset, not a study; give its study; elastica check b.nc says"),
        (("plan", "c.nc"), "c.nc: this is a dataset, not a study; give its study; elastica check c.nc says"),
        (("reduce", "b.nc"), "b.nc: this is a dataset, not a study"),
        (("check", "d.png"), "d.png: this is a figure, not a dataset; give the path of a dataset"),
        (("run", "d.png"), "d.png: this is a figure, not a study; give the path of a study"),
    ],
)
def test_a_file_of_another_kind_is_told_as_such(arguments, message, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name, content in KINDS.items():
        (tmp_path / name).write_bytes(content)
    result = invoke(*arguments)
    assert result.exit_code == 2
    assert message in result.output
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(KINDS)


def test_windows_is_told_in_one_sentence():
    code = (
        "import sys; sys.modules |= dict.fromkeys(['fcntl', 'resource', 'pwd', 'grp', 'termios'])\n"
        "import studies; from studies.command_line import main; sys.platform = 'win32'\n"
        "try: studies.run\n"
        "except studies.StudyError as problem: print(problem)\n"
        "main(['solve', '--state', 'U', '--P', '2', '--H', '0.1'])"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert "need Linux, macOS or, on Windows, WSL" in run.stdout
    assert (run.returncode, run.stderr) == (2, f"Error: {run.stdout}")


@pytest.mark.parametrize("encoding", ["latin-1", "ascii", "cp1252"])
def test_a_locale_that_cannot_show_everything_stops_nothing(encoding, dataset_file, toml, tmp_path):
    toml.write_text(toml.read_text().replace('title = "', 'title = "κ → 90° '), encoding="utf-8")
    commands = [
        ("solve", "--help"),
        ("check", dataset_file, "--sample", 1),
        ("catalog", "list", "--catalog", tmp_path),
        ("plan", toml),
        ("states", "--P", 2, "--H", 0.1),
        ("transitions", "--state", "U", "--H", 0.1),
        ("plan", "κ.toml"),
    ]
    for command in commands:
        result = invoke_with(encoding, *command)
        assert (result.exit_code, "Traceback" in result.output) == (2 * ("κ.toml" in command), False)


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


def test_want_of_memory_is_one_sentence(monkeypatch):
    def more(*_, **__):
        raise MemoryError

    monkeypatch.setattr("elastica.solving.solve", more)
    result = invoke("solve", "--state", "U", "--P", 2.5, "--H", 0.1)
    assert (result.exit_code, "there is not enough memory" in result.stderr) == (2, True)
    assert isinstance(result.exception, SystemExit)
