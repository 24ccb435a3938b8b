"""Makes `hashes.json`, with which `check.py` compares: values of the code as it is when this runs.

    OPENBLAS_NUM_THREADS=1 .venv/bin/python tests/same_values/make_hashes.py

The studies and the calls that are drawn here are stored with their hashes and need not be drawn again. Only
public entry points are used: the modules behind them may move.
"""

import hashlib
import json
import math
import platform
import tempfile
import tomllib
import warnings
from pathlib import Path

import numpy as np
import scipy
import xarray

import elastica
import studies

HERE = Path(__file__).parent
CATALOGS = HERE.parents[1] / "catalogs"
HASHES = HERE / "hashes.json"
SEED = 20261127

THINNED = ("clamped-chart", "pinned-chart", "shortening-control", "spring-ends")
"""Studies of the catalogue that take more than two seconds."""
MOST_LABELS = 12

CALLS = {
    "solve": elastica.solve,
    "find_states": elastica.find_states,
    "transitions": elastica.transitions,
    "loading_path": studies.loading_path,
}
TEXTS = ("reasons", "not_followed")
"""Attributes of answers that are texts, by the number of the point."""


def content_hash(content, folder, **policy):
    """Content hash of the dataset of a study; versions, times, hosts and history are not in it."""
    study = studies.Study.from_dict(content)
    with studies.run(study, out=Path(folder) / f"{study.name}.nc", **policy) as dataset:
        return dataset.attrs["content_hash"]


def catalogue(name):
    """A study of the catalogue, as its file has it."""
    return tomllib.loads((CATALOGS / f"{name}.toml").read_text())


def thinned(name):
    """A study of the catalogue; of one that takes long every k-th label of the axes that have many."""
    content = catalogue(name)
    if name in THINNED:
        for axis in ("H", "P", "shortening"):
            if axis in content["grid"]:
                given = content["grid"][axis]
                labels = np.linspace(given["start"], given["stop"], given["num"]).tolist()
                content["grid"][axis] = labels[:: math.ceil(len(labels) / MOST_LABELS)]
    return content


def answer_hash(call, attributes):
    """SHA-256 of every bit of an answer, and of what it is asked then.

    Parameters
    ----------
    call : dict
        `of`, a name of `CALLS`, its `arguments`, and `then`, methods of the answer with an argument each.
    attributes : dict of str to list of str
        What an answer of this call, or of this method, consists of. It is added if it is not there.
    """
    digest = hashlib.sha256()
    answer = CALLS[call["of"]](**call["arguments"])
    _take_in(digest, call["of"], answer, attributes)
    for method, argument in call["then"]:
        _take_in(digest, method, getattr(answer, method)(argument), attributes)
    return digest.hexdigest()


def _take_in(digest, kind, answer, attributes):
    if isinstance(answer, np.ndarray):
        _take_in_values(digest, kind, answer)
        return
    for name in attributes.setdefault(kind, _parts(answer)):
        values = answer[name].values if isinstance(answer, xarray.Dataset) else getattr(answer, name)
        _take_in_values(digest, name, values)


def _parts(answer):
    """Names of what an answer consists of, in order."""
    if isinstance(answer, xarray.Dataset):
        return sorted(answer.variables)
    public = (name for name in sorted(dir(answer)) if not name.startswith("_"))
    return [name for name in public if name in TEXTS or isinstance(getattr(answer, name), np.ndarray)]


def _take_in_values(digest, name, values):
    if isinstance(values, dict):
        digest.update(f"{name} {json.dumps(values, sort_keys=True)}".encode())
    elif values.dtype.kind in "OU":
        digest.update(f"{name} {json.dumps(values.tolist())}".encode())
    else:
        # All NaN alike: their bits tell nothing.
        values = np.where(np.isnan(values), np.nan, values).astype(values.dtype.newbyteorder("<"))
        digest.update(f"{name} {values.dtype.str} {values.shape}".encode())
        digest.update(values.tobytes())


class Draw:
    """What is drawn from the seed."""

    def __init__(self, seed):
        self.rng = np.random.default_rng(seed)

    def one(self, *choices):
        return choices[self.rng.integers(len(choices))]

    def some(self, count, *choices):
        """So many of the choices, in their order."""
        return [choices[i] for i in sorted(self.rng.choice(len(choices), count, replace=False))]

    def number(self, low, high):
        return float(f"{self.rng.uniform(low, high):.5g}")

    def numbers(self, count, low, high):
        return sorted({self.number(low, high) for _ in range(count)})

    def spring(self):
        return f"{10 ** self.rng.uniform(-2, 1.5):.3g}"

    def springs(self):
        """Ends of which at least one is a spring."""
        other = self.one("clamped", "pinned", self.spring())
        return "/".join(self.one((self.spring(), other), (other, self.spring())))

    def outputs(self):
        return {
            "eigenvalues": int(self.rng.integers(4)),
            "frequencies": int(self.rng.integers(4)),
            "shapes": self.one(0, 0, 5, 12),
        }

    def profile(self):
        return [self.number(0.85, 1.2) for _ in range(self.one(3, 4, 5))]

    def axes(self, control="P", count=5):
        H = self.numbers(2, 0.02, 0.2)
        return {"H": H, control: self.numbers(count, *((0.2, 10.0) if control == "P" else (0.005, 0.3)))}


NAMED = ("clamped-clamped", "pinned-pinned", "clamped-pinned", "pinned-clamped")
STATES = ("0", "B1", "B2", "U", "Ua", "aUa", "U-", "UD", "UD-", "UU", "UDa", "UDU", "UDU-", "UUD", "UDUD")


def random_studies(draw):
    """Contents of 40 small studies: all that a study file can ask for."""
    tables = []
    for number in range(8):
        grid = {"ends": draw.some(1 + number % 2, *NAMED), **draw.axes()}
        tables.append({"grid": grid, "states": {"max_contacts": number % 3}, "outputs": draw.outputs()})
    for _ in range(8):
        grid = {"ends": draw.some(2, *NAMED), **draw.axes()}
        tables.append({"grid": grid, "states": {"names": draw.some(3, *STATES)}, "outputs": draw.outputs()})
    for number in range(6):
        grid = {"ends": [draw.springs(), draw.one(*NAMED)], **draw.axes()}
        states = {"names": ["0", *draw.some(2, "B1", "U", "Ua", "U-", "UD")]}
        if number == 5:
            states = {"max_contacts": 0}
        tables.append({"grid": grid, "states": states, "outputs": draw.outputs()})
    for number in range(6):
        ends = [draw.springs()] if number == 5 else draw.some(1 + (number == 1), *NAMED)
        grid = {"ends": ends, **draw.axes("shortening")}
        names = ["U-"] if number == 5 else ["0", "B1", *["U-"] * (number > 1), *["U"] * (number == 4)]
        states = {"max_contacts": 0} if number == 0 else {"names": names}
        tables.append({"grid": grid, "states": states, "outputs": draw.outputs()})
    for number in range(7):
        grid = {"ends": draw.some(1 + number % 2, *NAMED), **draw.axes(count=3)}
        if number == 3:
            grid = {"ends": ["clamped-clamped"], "H": [0.05], "shortening": [0.02, 0.05]}
        solve = {"method": "chain", "links": draw.one(40, 48, 57)}
        solve["clamp"] = ("published", "consistent")[number % 2]
        if number in (2, 5):
            grid["ends"], solve["stiffness"] = ["clamped-clamped"], draw.profile()
        one_contact = draw.some(2, "U", "Ua", "U-")
        states = {"names": [*one_contact, *([] if number % 2 == 0 or number in (3, 5) else ["UD"])]}
        if number == 6:
            states = {"max_contacts": 1}
        outputs = draw.outputs()
        tables.append({"grid": grid, "states": states, "solve": solve, "outputs": outputs})
    for number in range(3):
        low, high = draw.number(0.03, 0.06), draw.number(0.12, 0.2)
        grid = {
            "ends": draw.some(1 + number % 2, *NAMED),
            "refine": {"levels": draw.one(2, 3), "audit": draw.one(0, 1, 2)},
            "H": {"start": low, "stop": high, "num": 3, "spacing": draw.one("linear", "log")},
            "P": {"start": draw.number(0.2, 0.5), "stop": draw.number(5, 9), "num": 4},
        }
        tables.append({"grid": grid, "states": {"names": ["0", *draw.some(2, "U", "U-", "UD")]}})
    for number in range(2):
        grid = {"ends": draw.some(1, *NAMED[:3]), **draw.axes()}
        tables.append(
            {
                "grid": grid,
                "states": {"names": [["0", "U"], ["B1", "U-"]][number]},
                "outputs": {"transitions": True, "eigenvalues": number},
            }
        )
    return [{"study": {"name": f"random-{number:02d}"}, **table} for number, table in enumerate(tables)]


ASKED = ("eigenvalues", "frequencies", "conventional", "shape")
WORDS = (
    *("0", "B1", "B2", "B3", "U", "Ua", "aUa", "U-", "UU", "UUa", "UD", "UDa", "aUDa", "UD-", "UDU", "UDUa"),
    *(
        "UUD",
        "UDU-",
        "UDUD",
        "UDUDU",
        "UDUDUD-",
        "UUDD",
        "UDUUD",
        "UDUDUDUD",
        "UDUDUDUDUDUD",
        "UDUDUDUDUDUD-",
    ),
    *("U:2", "U:3", "UD:2", "UU:2", "UDU:2", "UDa:2"),
)


def random_calls(draw):
    """Some 70 calls, with what their answers are asked then."""
    calls = []

    def add(of, then=(), **arguments):
        calls.append({"of": of, "arguments": arguments, "then": [list(each) for each in then]})

    def asked(count):
        return [(name, 9 if name == "shape" else draw.one(1, 3)) for name in draw.some(count, *ASKED)]

    for number, state in enumerate(WORDS):
        highest = 10.0 if len(state) < 7 else 300.0
        P, H = draw.numbers(6, 0.3, highest), draw.numbers(2, 0.01, 0.15 if len(state) < 7 else 0.03)
        add("solve", asked(1 + number % 2), state=state, ends=draw.one(*NAMED), P=[P], H=[[h] for h in H])
    for state in ("0", "B1", "U", "Ua", "U-", "UD"):
        P, H = draw.numbers(5, 0.3, 8.0), draw.number(0.03, 0.15)
        add("solve", asked(2), state=state, ends=draw.springs(), P=P, H=H)
    for number, state in enumerate(("0", "B1", "U", "Ua", "U-", "U:2", "B1", "U-")):
        given, H = draw.numbers(5, 0.005, 0.3), draw.number(0.03, 0.15)
        ends = draw.springs() if number > 5 else draw.one(*NAMED)
        add("solve", asked(2), state=state, ends=ends, shortening=given, H=H)
    # Points that fail, each with its reason.
    add("solve", state="U", P=[-1.0, 2.5, 2e6], H=[0.1, -0.1, 0.1])
    chain = [{"clamp": "published"}, {"clamp": "consistent"}, {"stiffness": draw.profile()}, {"links": 121}]
    for state, more in zip(("U", "Ua", "U", "UD"), chain, strict=True):
        arguments = {"method": "chain", "links": 80, "ends": draw.one(*NAMED[:2])} | more
        add(
            "solve", asked(2), state=state, P=draw.numbers(3, 1.2, 5.0), H=draw.number(0.05, 0.1), **arguments
        )
    add("solve", asked(2), state="U", shortening=[0.03, 0.05], H=0.08, method="chain", links=80)
    add("solve", asked(2), state="U-", P=[3.0, 5.0], H=0.08, ends=draw.springs(), method="chain", links=80)
    for number in range(5):
        P, H = draw.numbers(2, 0.5, 9.0), draw.number(0.03, 0.15)
        add("find_states", P=P, H=H, ends=draw.one(*NAMED), max_contacts=1 + number % 3)
    add("find_states", shortening=draw.numbers(2, 0.01, 0.2), H=0.06, ends="pinned-pinned", max_contacts=1)
    for state in ("0", "B1", "U", "U-"):
        add("transitions", state=state, H=[draw.number(0.04, 0.15)], ends=draw.one(*NAMED))
    add("transitions", state="B1", H=[draw.number(0.04, 0.15)], control="shortening")
    add("loading_path", ends="clamped-clamped", H=draw.number(0.05, 0.15), P=[0.5, 1.5, 3.0, 6.0, 3.0, 0.5])
    add("loading_path", ends="pinned-pinned", H=0.1, P=[0.2, 0.5, 2.0, 0.5])
    add("loading_path", ends="clamped-clamped", H=0.1, shortening=[0.0, 0.01, 0.03, 0.06, 0.03, 0.0])
    return calls


def make():
    """All that `hashes.json` holds."""
    draw, attributes = Draw(SEED), {}
    contents = random_studies(draw)
    calls = random_calls(draw)
    ways = draw.rng.permutation(len(contents))
    names = [content["study"]["name"] for content in contents]
    refined = {content["study"]["name"] for content in contents if "refine" in content["grid"]}
    order = [names[i] for i in ways]
    quarter = len(names) // 4
    two_workers = order[:quarter]
    # Which points a refined study needs is not known in shards; with one pair of ends one shard has it all.
    cut = {content["study"]["name"] for content in contents if len(content["grid"]["ends"]) > 1} - refined
    shards = [name for name in order[quarter:] if name in cut][:quarter]
    index = json.loads((CATALOGS / "index.json").read_text())["entries"]
    archived = {Path(name).stem: entry["content_hash"] for name, entry in index.items()}
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings(action="ignore"):
        whole, thin, random = {}, {}, {}
        for file in sorted(CATALOGS.glob("*.toml")):
            name = file.stem
            whole[name] = archived.get(name) or content_hash(catalogue(name), Path(folder), workers=0)
            (Path(folder) / f"{name}.nc").unlink(missing_ok=True)
            if name in THINNED:
                thin[name] = content_hash(thinned(name), folder, workers=0)
        for content in contents:
            hashed = content_hash(content, folder, workers=0)
            random[content["study"]["name"]] = {"study": content, "content_hash": hashed}
        answers = [{"call": call, "sha256": answer_hash(call, attributes)} for call in calls]
    return {
        "made_with": {
            "machine": platform.processor() or platform.machine(),
            "numpy": np.__version__,
            "scipy": scipy.__version__,
        },
        "catalogue": whole,
        "thinned": thin,
        "random": random,
        "two_workers": sorted(two_workers),
        "shards": sorted(shards),
        "attributes": attributes,
        "answers": answers,
    }


if __name__ == "__main__":
    HASHES.write_text(json.dumps(make(), indent=1) + "\n")
