"""Study files and datasets with something changed at random: bytes, words, tables; bits, pages, variables."""

import copy
import datetime
import json
import tomllib

import netCDF4
import numpy as np
import tomli_w

TOKENS = (
    *[
        "nan",
        "inf",
        "-inf",
        "-1",
        "0",
        "1e400",
        "1e-400",
        "true",
        "[]",
        "{}",
        '""',
        "[[",
        "]",
        "=",
        "\n",
        "#",
    ],
    *["\x00", "num", '"""', "'", "0x" + "f" * 5000, "9" * 5000, "1979-05-27", "07:32:00", "\ufeff", "a.b"],
    *["[grid]\n", "[[grid.H]]\n", "P = 1\n", "\r", "\u2028", "💥", "\\ud800", "_", "é"],
)
VALUES = (
    *[-1, 0, 1, 2, 7, 51, 1000, 10**6, 10**9, 2**63, -(2**63), 10**400, int("f" * 4000, 16)],
    *[0.0, -0.0, 0.1, 0.5, 1.0, 2.5, 1e-300, 5e-324, 1e300, 1e308, float("nan"), float("inf"), float("-inf")],
    *[True, False, "", " ", "0", "U", "Ua-", "U:99", "U" * 51, "B0", "B99999999999", "aDa", "exact", "chain"],
    *["clamped-clamped", "0.3/2.5", "1e400/0", "nan/inf", "-", "/", "../evil", "x" * 5000, "a\nb", "\x00"],
    *["💥", "\u202e", "e\u0301", "published", "consistent", "log", "linear", "square"],
    *[datetime.date(1979, 5, 27), datetime.time(7, 32), datetime.datetime(1979, 5, 27, 7, 32)],
    *[[], [[]], [{}], [0.1], [0.1, 0.2], [0.2, 0.1], [0.1, 0.1], [0.1, "a"], [True], [[0.1]], ["U", "U"], {}],
    *[{"start": 0.1, "stop": 0.2, "num": 1_000_000}, {"start": 1, "stop": 2}, {"num": 3}, {"a": {"b": {}}}],
    *[{"start": 0.1, "stop": 0.4, "num": 3, "spacing": "log"}, {"start": [], "stop": {}}],
    *[{"levels": 3}, {"levels": 1, "audit": 1000}],
    *[list(range(1, 1000)), ["clamped-clamped"] * 100, [f"{k}/1" for k in range(30)]],
)
KEYS = (
    *["name", "title", "ends", "H", "P", "shortening", "start", "stop", "num", "spacing", "max_contacts"],
    *["names", "method", "links", "clamp", "stiffness", "eigenvalues", "frequencies", "shapes", "grid"],
    *["study", "states", "solve", "outputs", "refine", "", " ", "a\nb", "💥", "x" * 1000, "__class__", "0"],
)


def mutated_study(text, rng):
    """A study file, bytes, with one or a few things changed, as text or as tables."""
    change = _changed_text if rng.random() < 0.3 else _changed_tables
    for _ in range(int(rng.geometric(0.7))):
        text = change(text, rng)
    content = text.encode("utf-8", "surrogatepass")
    if rng.random() < 0.05:
        place = int(rng.integers(len(content) + 1))
        content = content[:place] + rng.bytes(int(rng.integers(1, 4))) + content[place + 1 :]
    return content


def _one_of(rng, some):
    return some[int(rng.integers(len(some)))]


def _changed_text(text, rng):
    """Characters, words or lines gone, replaced, or there twice."""
    place = int(rng.integers(len(text) + 1))
    end = place + int(rng.integers(12))
    kind = rng.integers(5)
    if kind == 0:
        return text[:place] + text[end:]
    if kind == 1:
        return text[:place] + _one_of(rng, TOKENS) + text[end:]
    if kind == 2:
        return text[:place] + chr(int(rng.integers(1, 0x2FF))) + text[place + 1 :]
    lines = text.splitlines(keepends=True) or [""]
    line = lines.pop(int(rng.integers(len(lines)))) if kind == 3 else _one_of(rng, lines)
    lines.insert(int(rng.integers(len(lines) + 1)), line)
    return "".join(lines)


def _changed_tables(text, rng):
    """A valid file of the same tables but for a key or a value."""
    try:
        content = tomllib.loads(text)
    except (ValueError, RecursionError):
        return _changed_text(text, rng)
    places = list(_entries(content)) or [(content, "")]
    # Mostly values: where a whole table is wrong nothing else is looked at.
    places = [place for place in places if not isinstance(place[0].get(place[1]), dict)] * 5 + places
    table, key = _one_of(rng, places)
    kind = rng.integers(6)
    if kind == 0:
        table.pop(key, None)
    elif kind == 1:
        table[_one_of(rng, KEYS)] = table.pop(key, 0)
    elif kind == 2:
        table[_one_of(rng, KEYS)] = copy.deepcopy(_one_of(rng, VALUES))
    elif kind == 3:
        table[key] = [copy.deepcopy(table.get(key))] * int(rng.integers(1, 4))
        table[key] = [value for value in table[key] if value is not None]
    elif kind == 4 and isinstance(table.get(key), (int, float)):
        table[key] *= _one_of(rng, (-1, 0, 2, 1000, 10**6, 0.5, 1e-12, 1e12))
    else:
        table[key] = copy.deepcopy(_one_of(rng, VALUES))
    try:
        return tomli_w.dumps(content)
    except (TypeError, ValueError):  # A text that TOML has no way to write.
        return _changed_text(text, rng)


def _entries(table):
    """Every table of a file, with each of its keys."""
    for key, value in table.items():
        yield table, key
        if isinstance(value, dict):
            yield from _entries(value)


def damaged_dataset(content, rng):
    """Bytes of a dataset with bits flipped, a stretch zeroed, copied or random, an end cut off or added."""
    content = bytearray(content)
    size = len(content)
    for _ in range(int(rng.integers(1, 4))):
        # Half of the damage where the structure of the file is, which is at its beginning and its end.
        place = int(rng.integers(size))
        place = [place, place, place % 4000, size - 1 - place % 4000][rng.integers(4)]
        length = int(_one_of(rng, (1, 8, 64, 512, 4096)))
        kind = rng.integers(7)
        if kind <= 1:
            content[place : place + 1] = bytes([content[place] ^ (1 << int(rng.integers(8)))])
        elif kind == 2:
            content[place : place + length] = bytes(len(content[place : place + length]))
        elif kind == 3:
            content[place : place + length] = rng.bytes(len(content[place : place + length]))
        elif kind == 4:
            other = int(rng.integers(size))
            stretch = content[other : other + length]
            content[place : place + len(stretch)] = stretch
        elif kind == 5:
            content += rng.bytes(length)
        else:
            del content[place:]
            break
        size = len(content)
    return bytes(content)


def mutated_index(text, rng):
    """The index of a catalog with characters, keys or values changed."""
    for _ in range(int(rng.geometric(0.7))):
        if rng.random() < 0.3:
            text = _changed_text(text, rng)
            continue
        try:
            content = json.loads(text)
            table, key = _one_of(rng, list(_entries(content)) or [(content, "")])
            kind = rng.integers(4)
            if kind == 0:
                table.pop(key, None)
            elif kind == 1:
                table[_one_of(rng, NAMES_OF_FILES)] = table.get(key)
            elif kind == 2:
                table[_one_of(rng, KEYS)] = _one_of(rng, JSON_VALUES)
            else:
                table[key] = _one_of(rng, JSON_VALUES)
            text = json.dumps(content)
        except (ValueError, TypeError, AttributeError):  # No longer JSON, or no table: texts are changed.
            text = _changed_text(text, rng)
    return text


NAMES_OF_FILES = (
    *[
        "",
        ".",
        "..",
        "a",
        "a.nc",
        "../a.nc",
        "/etc/passwd",
        "a\0.nc",
        "\ud800.nc",
        "x" * 300 + ".nc",
        "index.json",
    ],
    *["index.lock", "-.nc", "\x1b[2J.nc", "\n.nc", "folder.nc", "💥.nc"],
)
JSON_VALUES = (
    *(value for value in VALUES if not isinstance(value, (datetime.date, datetime.time))),
    None,
    "\ud800",
)
ATTRIBUTES = (
    *["format_version", "study_id", "numerics_id", "content_hash", "config_json", "control", "title"],
    *["numerics_version", "states_searched", "date_created", "source", "Conventions", "points_not_computed"],
)
ATTRIBUTE_VALUES = (
    *["", "0", "💥", "{}", "null", "[1, 2]", '{"study": {"name": "x"}}', "[" * 100_000, "P", "shortening"],
    *[np.int32(2), np.int64(2**40), np.int8(-1), np.float64("nan"), np.float64(1.0), np.zeros(0, "i4")],
    *[np.array([1, 1], "i4"), "a\nb", "\x1b[31m"],
)
FLOATS = (np.nan, np.inf, -np.inf, -1.0, 0.0, 1e300, 5e-324, 0.25)


def edited_dataset(source, target, rng):
    """Write a sound netCDF file that differs from a dataset in variables, dimensions, types or attributes.

    Half of them are sealed again, so that the hash of the content does not give the change away.
    """
    kind = rng.integers(9)
    with netCDF4.Dataset(source) as old, netCDF4.Dataset(target, "w") as new:
        for file in (old, new):
            file.set_auto_maskandscale(False)
            file.set_auto_chartostring(False)
        chosen = _one_of(rng, list(old.variables))
        axis = _one_of(rng, list(old.dimensions))
        attributes = {name: old.getncattr(name) for name in old.ncattrs()}
        if kind == 0:
            attributes[_one_of(rng, ATTRIBUTES)] = _one_of(rng, ATTRIBUTE_VALUES)
        elif kind == 1:
            attributes.pop(_one_of(rng, ATTRIBUTES), None)
        new.setncatts(attributes)
        for name, dimension in old.dimensions.items():
            size = dimension.size
            if kind == 2 and name == axis:
                size = int(_one_of(rng, (1, size + 1, max(1, size - 1), 300)))
            new.createDimension(f"{name}_" if kind == 3 and name == axis else name, size)
        for name, variable in old.variables.items():
            if kind == 4 and name == chosen:
                continue
            dims, values, dtype = variable.dimensions, variable[:], variable.dtype
            if kind == 3:
                dims = tuple(f"{dim}_" if dim == axis else dim for dim in dims)
            if kind == 5 and name == chosen:
                dims, values = dims[::-1], values.T
            if kind == 6 and name == chosen and dtype.kind != "S":
                dtype = np.dtype(_one_of(rng, ("i1", "i4", "i8", "u2", "f4", "f8")))
                with np.errstate(invalid="ignore"):
                    values = values.astype(dtype)
            if kind >= 7 and name == chosen and values.size:
                values = _with_one_value_changed(values, rng)
            sizes = tuple(new.dimensions[dim].size for dim in dims)
            values = np.resize(values, sizes) if values.shape != sizes else values
            created = new.createVariable(name, dtype, dims, zlib=bool(dims), fletcher32=bool(dims))
            created.setncatts(
                {key: variable.getncattr(key) for key in variable.ncattrs() if key != "_FillValue"}
            )
            created[...] = values
    if rng.random() < 0.5:
        _seal(target)


def _with_one_value_changed(values, rng):
    values = values.copy()
    place = int(rng.integers(values.size))
    if values.dtype.kind == "S":
        values.flat[place] = _one_of(rng, (b"\xff", b"", b"U", b":", b"9", b"\n"))
    elif values.dtype.kind == "f":
        values.flat[place] = _one_of(rng, FLOATS)
    else:
        low, high = np.iinfo(values.dtype).min, np.iinfo(values.dtype).max
        values.flat[place] = _one_of(rng, (low, high, -1, 0, 1, 7))
    return values


def _seal(path):
    from studies.store.content import content_hash

    digest = content_hash(path)
    with netCDF4.Dataset(path, "a") as dataset:
        if "content_hash" in dataset.ncattrs():
            dataset.content_hash = digest
