import copy
import json
import tracemalloc
from pathlib import Path

import numpy as np
import pytest

from studies import Study, StudyError
from studies.design.costs import bytes_of
from studies.design.plan import LARGEST_ARRAY, Reusable
from studies.design.refinement import first_points
from studies.schema import canonical

GOOD = {
    "study": {"name": "small"},
    "grid": {
        "ends": ["clamped-clamped", "pinned-pinned"],
        "H": [0.05, 0.1],
        "P": {"start": 0.5, "stop": 5.0, "num": 10},
    },
    "states": {"max_contacts": 1},
    "outputs": {"eigenvalues": 2},
}


def changed(key, value):
    content = copy.deepcopy(GOOD)
    *tables, last = key.split(".")
    table = content
    for name in tables:
        table = table.setdefault(name, {})
    if value is None:
        del table[last]
    else:
        table[last] = value
    return content


BAD = [
    ("surprise", {}, "unknown key surprise; allowed here are study, grid, states, solve, outputs"),
    ("grid.Q", [1.0], "unknown key grid.Q; allowed here are ends, refine, H, P"),
    (
        "grid.P.step",
        0.1,
        "unknown key grid.P.step (did you mean 'stop'?); allowed here are start, stop, num, spacing",
    ),
    ("grid", None, "[grid] is missing; add it"),
    ("grid.H", None, "grid.H is missing"),
    ("grid.H", [], "grid.H: the axis is empty"),
    ("grid.H", [0.2, 0.1], "grid.H: 0.1 follows 0.2; values must increase"),
    ("grid.H", [0.1, 0.1 + 1e-15], "grid.H: 0.1 follows 0.1"),
    ("grid.H", [0.1, float("nan")], "grid.H: nan is not a finite number"),
    ("grid.H", [0.1, 0.5], "grid.H: values run from 0.1 to 0.5; keep 0 < H < 0.5"),
    ("grid.H", [0.0, 0.1], "keep 0 < H < 0.5"),
    ("grid.H", [True], "True is not a finite number"),
    ("grid.H", "0.1", "neither a list nor"),
    ("grid.P", [10**400], "is not a finite number"),
    ("grid.P", {"start": 5.0, "stop": 1.0, "num": 3}, "stop = 1.0 is not above start = 5.0"),
    ("grid.P.num", 1_000_000_000_000, "grid.P.num"),
    ("grid.P", "x" * 5000, "xxx… is neither a list nor"),
    ("grid.a\nb", 1, "unknown key grid.'a\\nb'; allowed"),
    ("solve", {"method": "chain", "links": 16**5000}, "solve.links = a number of thousands of digits"),
    ("grid.ends", ["x" * 5000], "xxx… is not allowed; string should have at most 100 characters"),
    ("grid.shortening", [0.1], "grid: give either P or shortening"),
    ("grid.P", None, "grid: give either P or shortening"),
    ("grid", {"ends": ["0/1"], "H": [0.1], "shortening": [0.1, 2.0]}, "keep 0 <= shortening < 2"),
    ("grid", {"ends": ["0/1"], "H": [0.1], "shortening": [-0.1]}, "keep 0 <= shortening < 2"),
    ("grid.ends", ["-1/2"], "spring constant k >= 0"),
    ("grid.ends", ["0/1.0", "pinned/1"], "names an end condition twice"),
    ("states", {"names": ["U" * 51]}, "has 51 contacts; at most 50"),
    ("states.max_contacts", 11, "use a whole number from 0 to 10"),
    ("outputs.frequencies", -1, "outputs.frequencies = -1"),
    ("grid.P", [-1.0], "keep 0 <= P <= 1e6"),
    ("grid.P", [1.0, 2e6], "keep 0 <= P <= 1e6"),
    ("grid.P.num", 2.5, "grid.P.num = 2.5 is not allowed; write a whole number"),
    ("grid.P.num", 0, "grid.P.num = 0"),
    ("grid.P.num", 10**9, "grid.P.num = 1000000000"),
    ("grid.P.spacing", "square", "grid.P.spacing = 'square'"),
    ("grid.P", {"start": 0.0, "stop": 1.0, "num": 3, "spacing": "log"}, "cannot start at 0"),
    ("grid.ends", ["clamped-free"], "'clamped-free' is not known; write \"A-B\""),
    ("grid.ends", 7, "grid.ends.0 = 7 is not allowed; write a text"),
    ("grid.ends", {}, "write a list"),
    ("grid.ends", "clamp", "'clamp' is not known (did you mean 'clamped-clamped'?); write"),
    ("grid.max_contacts", 1, "unknown key grid.max_contacts, which belongs to [states]; allowed here"),
    ("outputs.refine", {"levels": 1}, "unknown key outputs.refine, which belongs to [grid]; allowed here"),
    ("grid.solve", {}, "unknown key grid.solve, which is a table of its own, [solve]; allowed here"),
    ("grid.h", [0.1], "unknown key grid.h (did you mean 'H'?); allowed here are ends"),
    ("outputs.eigenvalue", 3, "unknown key outputs.eigenvalue (did you mean 'eigenvalues'?)"),
    ("solve", {"method": "chian"}, "(did you mean 'chain'?); use 'exact' or 'chain'"),
    ("states", {"names": "u-"}, "states.names: state = 'u-' is not known (did you mean 'U-'?)"),
    ("grid.ends", [], "name at least one"),
    ("grid.ends", ["clamped-clamped", "clamped/clamped"], "names an end condition twice"),
    ("states", {"names": ["Q"]}, "states.names: state = 'Q' is not known"),
    ("states", {"names": []}, "names is empty"),
    ("states", {"names": ["U"], "max_contacts": 1}, "either max_contacts or names"),
    ("states", {}, "either max_contacts or names"),
    ("states.max_contacts", 99, "max_contacts = 99"),
    ("states.max_contacts", True, "states.max_contacts = True"),
    ("solve", {"method": "magic"}, "solve.method = 'magic'"),
    ("outputs.eigenvalues", -1, "outputs.eigenvalues = -1"),
    ("outputs.eigenvalues", "2", "outputs.eigenvalues = '2' is not allowed; write a whole number"),
    ("outputs.shapes", 1, "1 sample is no shape"),
    ("study.name", "../evil", "use letters, digits"),
    ("study.name", 7, "write a text"),
    ("study", 7, "study = 7 is not allowed; write a table"),
]


@pytest.mark.parametrize(("key", "value", "message"), BAD, ids=[f"{case[0]}: {case[2]}" for case in BAD])
def test_a_mistake_is_one_sentence_with_file_key_value_and_remedy(key, value, message):
    with pytest.raises(StudyError) as problem:
        Study.from_dict(changed(key, value), "bad.toml")
    text = str(problem.value)
    assert text.startswith("bad.toml: ")
    assert message in text
    assert "\n" not in text


@pytest.mark.parametrize(
    ("key", "one"),
    [
        ("grid.H", 0.1),
        ("grid.P", 2),
        ("grid", {"ends": "0.3/2.5", "H": 0.1, "shortening": 0}),
        ("grid.ends", "clamped-pinned"),
        ("states", {"names": "U"}),
    ],
)
def test_one_value_is_a_list_of_one(key, one):
    listed = {name: [value] for name, value in one.items()} if isinstance(one, dict) else [one]
    assert Study.from_dict(changed(key, one)).study_id == Study.from_dict(changed(key, listed)).study_id


def test_numbers_of_numpy_and_paths_are_numbers_and_texts():
    content = changed("outputs.eigenvalues", np.int64(2))
    content["study"]["name"] = Path("small")
    content["grid"] = {
        "ends": np.array(GOOD["grid"]["ends"]),
        "H": np.array([0.05, 0.1]),
        "P": {"start": np.float64(0.5), "stop": np.int32(5), "num": np.uint8(10)},
    }
    content["states"] = {"max_contacts": np.array(1)}
    content["outputs"]["transitions"] = np.bool_(False)
    assert Study.from_dict(content).study_id == Study.from_dict(GOOD).study_id
    with pytest.raises(StudyError, match="axis is empty"):
        Study.from_dict(changed("grid.H", np.array([])))


def test_a_misspelled_key_is_asked_after_before_what_it_leaves_missing():
    content = copy.deepcopy(GOOD)
    content["gird"] = content.pop("grid")
    with pytest.raises(StudyError, match=r"unknown key gird \(did you mean 'grid'\?\)"):
        Study.from_dict(content)
    content = changed("grid.H", {"start": 0.1, "stop": 0.2, "nums": 3})
    with pytest.raises(StudyError, match=r"unknown key grid.H.nums \(did you mean 'num'\?\)"):
        Study.from_dict(content)


def test_labels_are_canonical_so_that_grids_join():
    by_range = changed("grid.H", {"start": 0.0 + 0.1, "stop": 0.3, "num": 3})
    by_list = changed("grid.H", [0.1, 0.2, 0.3])
    assert Study.from_dict(by_range).grid.H == Study.from_dict(by_list).grid.H == (0.1, 0.2, 0.3)
    assert canonical(0.1 + 0.2) == 0.3


def test_a_grid_that_nobody_can_compute_is_refused():
    content = changed("grid.P.num", 1_000_000)
    content["grid"]["H"] = {"start": 0.01, "stop": 0.4, "num": 1_000_000}
    with pytest.raises(StudyError, match="points are too many"):
        Study.from_dict(content)


def test_the_blocks_of_a_large_grid_share_their_labels_and_too_many_are_refused(monkeypatch):
    """Otherwise the plan of a thousand million points takes gigabytes."""
    plan = Study.from_dict(GOOD).plan(block_points=4)
    first, *_ = plan.blocks
    same = [block for block in plan.blocks if block.place[::2] == first.place[::2]]
    assert len(same) == 2
    assert all(block.prescribed is first.prescribed for block in same)
    monkeypatch.setattr("studies.design.plan.MOST_BLOCKS", len(plan.blocks))
    assert Study.from_dict(GOOD).plan(block_points=4).blocks == plan.blocks
    monkeypatch.setattr("studies.design.plan.MOST_BLOCKS", len(plan.blocks) - 1)
    with pytest.raises(StudyError, match="study small: more than 11 blocks are too many"):
        Study.from_dict(GOOD).plan(block_points=4)


def test_more_random_points_than_memory_are_refused():
    content = changed("grid.refine", {"levels": 1, "audit": 1000})
    content["grid"] |= {name: {"start": 0.01, "stop": 0.4, "num": 1000} for name in ("H", "P")}
    with pytest.raises(StudyError, match=r"refine\.audit = 1000 in 998,001 cells are too many points"):
        Study.from_dict(content)


def test_a_state_without_meaning_for_one_end_leaves_a_plan(tmp_path):
    content = changed("states", {"names": ["Ua-"]})
    assert Study.from_dict(content).plan().states == 20


@pytest.mark.parametrize("text", ["a = [" * 5000, "num = " + "9" * 5000, "[study", "\xff"])
def test_files_that_are_no_toml(tmp_path, text):
    path = tmp_path / "bad.toml"
    path.write_bytes(text.encode("latin-1"))
    with pytest.raises(StudyError, match="this is no TOML file"):
        Study.from_toml(path)


SMALL = """[study]
name = "small"
title = "Für κ → 1"
[grid]
ends = "clamped-clamped"
H = 0.1
P = [1, 2]
[states]
max_contacts = 1
"""


def test_the_mark_that_some_editors_begin_with_is_no_part_of_a_study(tmp_path):
    plain, marked, dos = (tmp_path / name for name in ("plain.toml", "marked.toml", "dos.toml"))
    plain.write_bytes(SMALL.encode())
    marked.write_bytes(SMALL.encode("utf-8-sig"))
    dos.write_bytes(SMALL.replace("\n", "\r\n").encode("utf-8-sig"))
    assert Study.from_toml(marked) == Study.from_toml(plain) == Study.from_toml(dos)


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (SMALL.encode("utf-16"), "it is UTF-16"),
        (SMALL.encode("utf-32"), "it is UTF-32"),
        (SMALL.replace("κ → ", "").encode("latin-1"), "line 3 has the byte 0xfc, which is not UTF-8"),
    ],
)
def test_a_study_that_is_not_utf_8_says_how_to_save_it(tmp_path, content, reason):
    path = tmp_path / "small.toml"
    path.write_bytes(content)
    with pytest.raises(StudyError) as problem:
        Study.from_toml(path)
    assert str(problem.value) == f"{path}: this is no TOML file ({reason}); save it as UTF-8"


@pytest.mark.parametrize("start", ["a.", '"a".', "a . ", "[a.", "x = {a.", "'a'.\t"])
def test_a_key_that_would_take_the_parser_for_ever_is_refused_before(tmp_path, monkeypatch, start):
    monkeypatch.setattr("tomllib.loads", None)
    path = tmp_path / "dots.toml"
    path.write_text(f"a = 1\n{start}" + start.lstrip("[x= {") * 200_000 + "b = 1")
    with pytest.raises(StudyError, match=r"the key .* in line 2 has more than 16 dots\); mend"):
        Study.from_toml(path)


def test_a_file_that_is_too_large_for_a_study_is_not_read(tmp_path, monkeypatch):
    monkeypatch.setattr("studies.design.study.LARGEST_FILE", 100)
    monkeypatch.setattr("studies.design.toml.LARGEST_FILE", 100)
    path = tmp_path / "large.toml"
    path.write_text(SMALL)
    with pytest.raises(StudyError, match="it has more than 100 bytes"):
        Study.from_toml(path)


def test_log_axis():
    study = Study.from_dict(changed("grid.P", {"start": 1.0, "stop": 100.0, "num": 3, "spacing": "log"}))
    assert study.grid.P == (1.0, 10.0, 100.0)


def test_identity_covers_the_file_and_the_method_separately():
    study = Study.from_dict(GOOD)
    assert Study.from_dict(json.loads(study.config_json)).study_id == study.study_id
    other = Study.from_dict(changed("grid.H", [0.05, 0.11]))
    assert other.study_id != study.study_id
    assert other.numerics_id == study.numerics_id


def test_state_names_are_canonical_and_listed_once():
    study = Study.from_dict(changed("states", {"names": ["aU", "Ua", "D", "0"]}))
    assert study.state_names == ("Ua", "U", "0")


@pytest.mark.parametrize("block_points", [None, 1, 3, 7, 10, 11, 20, 1000])
def test_blocks_of_a_plan_cover_the_grid_exactly_once(block_points):
    study = Study.from_dict(GOOD)
    plan = study.plan(block_points=block_points)
    covered = np.zeros((2, 2, 10), int)
    for block in plan.blocks:
        e, i, j = block.place
        covered[e, i : i + len(block.H), j : j + len(block.prescribed)] += 1
        assert block.ends == study.grid.ends[e]
        assert block.H == study.grid.H[i : i + len(block.H)]
        assert block.prescribed == study.grid.P[j : j + len(block.prescribed)]
    assert (covered == 1).all()
    assert plan.points == 40


RANGE = {"start": 0.01, "stop": 0.4}
LARGE = {
    "dense": {name: RANGE | {"num": 31_622} for name in ("H", "P")},
    "by shortening": {name: RANGE | {"num": 31_622} for name in ("H", "shortening")},
    "refined": {"refine": {"levels": 8}, **{name: RANGE | {"num": 100} for name in ("H", "P")}},
}


@pytest.mark.parametrize("grid", LARGE.values(), ids=LARGE)
def test_the_plan_of_a_thousand_million_points_costs_what_its_blocks_do(grid):
    content = changed("grid", {"ends": ["clamped-clamped"], **grid})
    study = Study.from_dict(content)
    tracemalloc.start()
    try:
        plan = study.plan(block_points=10_000_000)
        plan.report(workers=2)
        most = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert plan.points > 6e8
    assert most < 60e6


@pytest.mark.parametrize("block_points", [None, 7])
@pytest.mark.parametrize("control", ["P", "shortening"])
@pytest.mark.parametrize("refine", [None, {"levels": 3, "audit": 2}])
def test_a_plan_is_the_same_whether_its_points_are_looked_at_or_not(control, refine, block_points):
    grid = {name: RANGE | {"num": 5} for name in ("H", control)} | ({"refine": refine} if refine else {})
    study = Study.from_dict(changed("grid", {"ends": GOOD["grid"]["ends"], **grid}))
    shape = len(study.grid.ends), len(study.grid.H), len(study.grid.prescribed)
    nothing = Reusable((), np.zeros(shape, bool), frozenset(), {})
    plan = study.plan(block_points=block_points)
    assert plan.blocks == study.plan(block_points=block_points, reuse=nothing).blocks
    if refine:
        wanted = first_points(shape[1:], study.grid.refine)
        rows, columns = np.nonzero(wanted)
        points = [
            (block.ends, *point) for block in plan.blocks for point in zip(*block.labels(), strict=True)
        ]
        H, given = (np.array(axis) for axis in (study.grid.H, study.grid.prescribed))
        assert points == [
            (ends, *point) for ends in study.grid.ends for point in zip(H[rows], given[columns], strict=True)
        ]


def test_plan_warns_of_a_huge_dataset_and_solves_nothing(monkeypatch):
    monkeypatch.setattr("studies.running.evaluate.solve", None)
    monkeypatch.setattr("studies.running.evaluate.search", None)
    content = changed("outputs", {"shapes": 100_000})
    content["grid"]["P"]["num"] = 20
    report = Study.from_dict(content).plan().report(workers=2)
    assert any(line.startswith("warning") and "1 GB" in line for line in report)
    assert not any("warning" in line for line in Study.from_dict(GOOD).plan().report(workers=2))


@pytest.mark.parametrize("control", ["P", "shortening"])
def test_blocks_of_many_samples_fit_into_memory_and_a_point_that_cannot_is_refused(control):
    content = changed("outputs", {"shapes": 100_000})
    content["grid"] = {"ends": ["clamped-clamped"], "H": [0.05, 0.1], control: RANGE | {"num": 500}}
    plan = Study.from_dict(content).plan()
    held = max(bytes_of(plan.study, plan.task, block.points) for block in plan.blocks)
    assert held <= LARGEST_ARRAY
    content["states"]["max_contacts"] = 5
    with pytest.raises(StudyError, match="one point may take 785 MB, and a block holds 400 MB; use fewer"):
        Study.from_dict(content).plan()


def test_a_search_asks_for_first_roots_and_a_list_for_what_it_names():
    assert Study.from_dict(GOOD).task.every_root
    task = Study.from_dict(changed("states", {"names": ["UD:2", "D"]})).task
    assert (task.names, task.every_root) == (("UD:2", "U"), False)


def test_roots_follow_their_word_in_the_order_of_the_states():
    task = Study.from_dict(changed("states.max_contacts", 2)).task
    found = ["UD:10", "U", "UD", "B1", "UD:2", "Ua:3", "Ua"]
    assert task.in_order(found) == ("B1", "U", "Ua", "Ua:3", "UD", "UD:2", "UD:10")
    assert task.in_order([]) == ("0",)


def test_blocks_of_prescribed_shortening_are_whole_rows():
    content = changed("grid.P", None)
    content["grid"] |= {"shortening": {"start": 0.0, "stop": 0.5, "num": 3000}}
    content["grid"]["H"] = {"start": 0.05, "stop": 0.2, "num": 50}
    blocks = Study.from_dict(content).plan().blocks
    assert all(len(block.prescribed) == 3000 for block in blocks)
    assert sum(len(block.H) for block in blocks) == 100
    assert len(blocks) > 2


def test_searches_for_long_words_go_in_small_blocks_and_say_that_roots_are_a_guess():
    content = changed("grid.P", {"start": 0.5, "stop": 5.0, "num": 100})
    content["grid"]["H"] = {"start": 0.05, "stop": 0.2, "num": 200}
    content["states"]["max_contacts"] = 2
    plan = Study.from_dict(content).plan()
    assert max(block.points for block in plan.blocks) <= 4000
    size = next(line for line in plan.report(1) if line.startswith("size"))
    assert "at most" in size
    assert "roots" in size


def test_springs_and_contacts_take_longer():
    def seconds(ends, contacts):
        content = changed("states.max_contacts", contacts)
        content["grid"]["ends"] = [ends]
        return Study.from_dict(content).plan().seconds

    assert seconds("0.3/2.5", 1) > 2 * seconds("clamped-pinned", 1)
    assert seconds("clamped-pinned", 3) > 2 * seconds("clamped-pinned", 1)
