"""Files that somebody made to mislead their reader, or to make it read what it should not."""

import shutil

import h5py
import numpy as np
import pytest
from click.testing import CliRunner
from netCDF4 import Dataset

import studies
from studies.command_line import main
from studies.errors import StudyError
from studies.sandbox import call
from studies.store.content import content_hash
from studies.store.datasets import identify
from studies.store.layout import write_failures


def edited(source, target, edit):
    """A copy of a dataset with something changed, sealed again as anybody can."""
    shutil.copy(source, target)
    with Dataset(target, "a") as dataset:
        edit(dataset)
    with Dataset(target, "a") as dataset:
        dataset.content_hash = content_hash(target)
    return target


DECODING = {
    "missing_value": ("stability", np.int8(0)),
    "_FillValue": ("stability", np.int8(0)),
    "scale_factor": ("energy", 2.0),
    "add_offset": ("energy", 1.0),
    "valid_range": ("energy", np.array([0.0, 1.0])),
    "valid_min": ("energy", 0.0),
    "valid_max": ("H", 0.1),
    "_Unsigned": ("status", "true"),
    "units": ("P", "days since 2000-01-01"),
    "calendar": ("P", "noleap"),
    "_Encoding": ("state", "utf-16"),
    "dtype": ("stability", "bool"),
    "coordinates": ("energy", "status"),
    "grid_mapping": ("energy", "status"),
    "ancillary_variables": ("energy", "error"),
    "bounds": ("H", "energy"),
    "cell_measures": ("energy", "area: error"),
    "flag_meanings": ("stability", "unstable stable unstable_third_order neutral_family critical not_solved"),
    "flag_values": ("stability", np.array([1, 0, 2, 3, 4, -1], "i1")),
    "long_name": ("energy", "x" * 100_000),
}


@pytest.mark.parametrize("key", DECODING)
def test_attributes_with_which_values_decode_otherwise_are_refused(dataset_file, tmp_path, key):
    name, value = DECODING[key]

    def edit(dataset):
        if key != "_FillValue":
            dataset.variables[name].setncattr(key, value)

    path = edited(dataset_file, tmp_path / "edited.nc", edit)
    if key == "_FillValue":  # netCDF gives none to a variable that has values.
        with h5py.File(path, "a") as file:
            file[name].attrs.create(key, [value])
    for use in (studies.open, studies.check, identify):
        with pytest.raises(StudyError, match=f"{name} has the attribute {key[:5]}.* = .* misread"):
            use(path)


def test_text_without_its_encoding_and_coordinates_of_the_file_are_refused(dataset_file, tmp_path):
    path = edited(dataset_file, tmp_path / "a.nc", lambda d: d.variables["state"].delncattr("_Encoding"))
    with pytest.raises(StudyError, match="state has no attribute _Encoding"):
        studies.open(path)
    path = edited(dataset_file, tmp_path / "b.nc", lambda d: d.setncattr("coordinates", "status energy"))
    with pytest.raises(StudyError, match="makes coordinates of variables"):
        studies.open(path)


def test_the_hash_covers_what_values_mean_and_old_files_keep_theirs(dataset_file, tmp_path):
    def in_format(version, edit=lambda dataset: None):
        path = edited(dataset_file, tmp_path / "edited.nc", edit)
        with Dataset(path, "a") as dataset:
            dataset.format_version = version
        return content_hash(path)

    def in_joules(dataset):
        dataset.variables["energy"].units = "J"

    def renamed(dataset):
        dataset.variables["energy"].long_name = "elan"

    assert in_format(1) == in_format(1, in_joules) != in_format(2)
    assert in_format(2) == in_format(2, renamed) != in_format(2, in_joules)


SECRET = b"root:x:0:0"


def replaced(make):
    """An edit that puts something else in the place of `energy`."""

    def edit(file, folder):
        old = file["energy"]
        shape, kept = old.shape, dict(old.attrs)
        del file["energy"]
        made = make(file, shape, folder)
        if made is not None:
            for key in ("units", "long_name"):
                made.attrs[key] = kept[key]

    return edit


def external(file, shape, folder):
    (folder / "secret").write_bytes(SECRET * 10_000)
    return file.create_dataset(
        "energy", shape, "f8", external=[(str(folder / "secret"), 0, 8 * np.prod(shape))]
    )


def virtual(file, shape, folder):
    with h5py.File(folder / "other.nc", "w") as other:
        other["energy"] = np.ones(shape)
    layout = h5py.VirtualLayout(shape, "f8")
    layout[...] = h5py.VirtualSource(folder / "other.nc", "energy", shape)
    return file.create_virtual_dataset("energy", layout)


def external_link(file, shape, folder):
    with h5py.File(folder / "other.nc", "w") as other:
        other["energy"] = np.ones(shape)
    file["energy"] = h5py.ExternalLink(str(folder / "other.nc"), "/energy")


def soft_link(file, shape, folder):
    file["energy"] = h5py.SoftLink("/curvature")


def nested(file, folder):
    group = file
    for _ in range(3000):
        group = group.create_group("g")


def huge_attribute(file, folder):
    file["energy"].attrs["comment"] = np.zeros(1, "S20000000")


def many_attributes(file, folder):
    for number in range(300):
        file["energy"].attrs[f"a{number}"] = 1


def many_texts(file, folder):
    file.attrs["history"] = ["x" * 1000] * 1000


def many_variables(file, folder):
    for number in range(300):
        file[f"v{number}"] = 1.0


def opaque_attribute(file, folder):
    file.attrs["history"] = np.void(b"abc")


def reference(file, folder):
    file["energy"].attrs["comment"] = file["curvature"].ref


def texts(file, shape, folder):
    return file.create_dataset("energy", shape, h5py.string_dtype())


def lists(file, shape, folder):
    return file.create_dataset("energy", shape, h5py.vlen_dtype("f8"))


def records(file, shape, folder):
    return file.create_dataset("energy", shape, [("a", "f8"), ("b", "i4")])


def filtered(file, shape, folder):
    return file.create_dataset("energy", shape, "f8", compression="lzf", chunks=True)


def huge_chunks(file, shape, folder):
    return file.create_dataset("energy", (1, 10**5, 10**5, 1), "f8", chunks=(1, 10**5, 10**4, 1))


def huge_labels(file, folder):
    file.create_dataset("labels", (10**12,), "f8", chunks=(10**6,))


def named_type(file, folder):
    file["kind"] = np.dtype("f8")


def empty(file, shape, folder):
    return file.create_dataset("energy", dtype="f8", data=h5py.Empty("f8"))


def empty_attribute(file, folder):
    file.attrs["title"] = h5py.Empty("f8")


def long_name(file, folder):
    file["x" * 60_000] = 1.0


def long_key(file, folder):
    file["energy"].attrs["x" * 60_000] = 1.0


def deep_study(file, folder):
    file.attrs["config_json"] = "[" * 100_000


@pytest.mark.parametrize(
    ("edit", "message"),
    [
        (replaced(empty), "'energy' has no values"),
        (empty_attribute, "'title' of the file has no value"),
        (long_name, "the name 'xxx.* is too long"),
        (long_key, "the name 'xxx.* of an attribute of 'energy' is too long"),
        (deep_study, "config_json holds no study"),
        (replaced(external), "'energy' lie in other files"),
        (replaced(virtual), "'energy' lie in other files"),
        (replaced(external_link), "'energy' is a link"),
        (replaced(soft_link), "'energy' is a link"),
        (replaced(texts), "'energy' has values of a type"),
        (replaced(lists), "'energy' has values of a type"),
        (replaced(records), "'energy' has values of a type"),
        (replaced(filtered), "'energy' is stored with a filter"),
        (replaced(huge_chunks), "'energy' has to be read in pieces of 8,000,000,000 bytes"),
        (huge_labels, "'labels' has to be read in pieces of 8,000,000,000,000 bytes"),
        (nested, "'g' is a group"),
        (named_type, "'kind' is a group or a type"),
        (huge_attribute, "'comment' of 'energy' is too large"),
        (many_texts, "'history' of the file is too large"),
        (many_attributes, "'energy' has 3.. attributes"),
        (many_variables, "it has 3.. variables"),
        (opaque_attribute, "'history' of the file is neither text nor numbers"),
        (reference, "'comment' of 'energy' is neither text nor numbers"),
    ],
)
def test_what_leads_out_of_a_file_or_needs_more_than_a_dataset_is_refused_unread(
    dataset_file, tmp_path, edit, message
):
    path = tmp_path / "hostile.nc"
    shutil.copy(dataset_file, path)
    with h5py.File(path, "a") as file:
        edit(file, tmp_path)
    for use in (studies.open, studies.check):
        with pytest.raises(StudyError, match=message):
            use(path)
    for command in (
        ["check", path],
        ["plot", path],
        ["merge", dataset_file, path, "-o", tmp_path / "out.nc"],
    ):
        result = CliRunner().invoke(main, [str(word) for word in command])
        assert (result.exit_code, result.output.count("\n")) == (2, 1), result.output


def test_names_of_variables_cannot_drive_a_terminal(dataset_file, tmp_path):
    path = tmp_path / "hostile.nc"
    shutil.copy(dataset_file, path)
    with h5py.File(path, "a") as file:
        file.create_group("\x1b[2J\u202e\n")
    result = CliRunner().invoke(main, ["check", str(path)])
    assert "\x1b" not in result.output
    assert result.output.count("\n") == 1


def test_both_libraries_of_hdf5_live_in_one_process(dataset_file):
    """The process that looks at files of unknown origin uses one after the other, over and over."""
    first = identify(dataset_file)
    for _ in range(20):
        assert identify(dataset_file) == first
    assert call(libraries, limit=60) == ["h5py", "netCDF4"]


def libraries():
    import sys

    return sorted({"h5py", "netCDF4"} & sys.modules.keys())


def test_declared_sizes_beyond_memory_are_refused_unread(dataset_file, tmp_path):
    """A file of a few megabytes with real labels, and a plane of a trillion points that was never written."""
    path = tmp_path / "vast.nc"
    with Dataset(dataset_file) as old, Dataset(path, "w") as new:
        old.set_auto_chartostring(False)
        new.setncatts({name: old.getncattr(name) for name in old.ncattrs()})
        for name, dimension in old.dimensions.items():
            new.createDimension(name, 1_000_000 if name in ("H", "P") else dimension.size)
        for name, variable in old.variables.items():
            dims = variable.dimensions
            made = new.createVariable(name, variable.dtype, dims, zlib=True)
            made.setncatts(
                {key: variable.getncattr(key) for key in variable.ncattrs() if key != "_FillValue"}
            )
            if dims[0] == name:
                made[:] = variable[:] if name not in ("H", "P") else np.linspace(0.01, 0.2, 1_000_000)
    assert path.stat().st_size < 2e7
    for command in ("check", "plot"):
        result = CliRunner().invoke(main, [command, str(path)])
        assert (result.exit_code, result.output.count("\n")) == (2, 1), result.output
        assert str(path) in result.output


def test_texts_of_a_file_cannot_drive_a_terminal_or_a_figure(dataset_file, tmp_path):
    wild = "\x1b[2J\r\n\u202e\u2066\u2028\x07$\\frac{$" + "x" * 10_000

    def edit(dataset):
        for name in ("title", "source", "date_created", "id", "history", "Conventions"):
            dataset.setncattr(name, wild)
        dataset["energy"].long_name = wild[:1000]
        write_failures(dataset, "P", [(0, 0, 0, 0, wild)])

    path = edited(dataset_file, tmp_path / "wild.nc", edit)
    for arguments in (["check", path, "--sample", 0], ["plot", path], ["plot", path, "--kind", "shapes"]):
        result = CliRunner().invoke(main, [str(word) for word in arguments])
        assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
        assert all(mark.isprintable() for mark in result.output.replace("\n", "")), result.output
        assert all(len(line) < 1000 for line in result.output.splitlines())
        assert result.exit_code == (2 if arguments[0] == "check" else 0), result.output


def test_names_of_files_cannot_drive_a_terminal(dataset_file, tmp_path):
    path = tmp_path / "\x1b[2J\n\u202e.nc"
    for command in (["check"], ["plot"], ["catalog", "add"], ["merge"], ["run"]):
        result = CliRunner().invoke(main, [*command, str(path)])
        assert result.exit_code == 2
        assert all(mark.isprintable() for mark in result.output.replace("\n", "")), result.output
