"""How a dataset is laid out in a netCDF file: dimensions, text as characters, chunks, the table of failures.

Not here: what the variables mean (`schema`), the files themselves (`files`).
"""

import numpy as np

from studies.schema import COORDINATES, failure_indices

CHUNK_BYTES = 4_000_000
COMPRESSION = {"zlib": True, "complevel": 4, "shuffle": True, "fletcher32": True}


def define(dataset, labels, variables, attributes, compressed=True):
    """Create dimensions, coordinates and variables in an empty dataset.

    Parameters
    ----------
    dataset : netCDF4.Dataset
    labels : dict of str to ndarray
        From `schema.coordinates`.
    variables : dict of str to Variable
        All of them must be written: what is not has no defined value.
    attributes : dict
        Global attributes, text or numbers.
    compressed : bool
        Whether in chunks that are compressed and have checksums.
    """
    filters = COMPRESSION if compressed else {}
    for dim, values in labels.items():
        dataset.createDimension(dim, values.size)
        write_labels(dataset, dim, values, COORDINATES[dim], filters)
    for name, variable in variables.items():
        sizes = [labels[dim].size for dim in variable.dims]
        created = dataset.createVariable(
            name,
            variable.dtype,
            variable.dims,
            chunksizes=chunks(variable, sizes) if compressed else None,
            fill_value=np.nan if variable.dtype == "f8" else False,
            **filters,
        )
        created.setncatts(variable.attributes)
    dataset.setncatts({"Conventions": "CF-1.11, ACDD-1.3", **attributes})


def write_labels(dataset, dim, values, attributes, filters=COMPRESSION):
    """A coordinate; text as a character array, which every netCDF reader understands."""
    if values.dtype.kind != "U":
        variable = dataset.createVariable(dim, values.dtype, (dim,), fill_value=False, **filters)
        variable.setncatts(attributes)
        variable[:] = values
        return
    width = max(1, *(len(text.encode()) for text in values))
    if f"string{width}" not in dataset.dimensions:
        dataset.createDimension(f"string{width}", width)
    # A column of a table runs along the rows of the table.
    owner = dim.partition("_")[0]
    variable = dataset.createVariable(dim, "S1", (owner, f"string{width}"), fill_value=False, **filters)
    variable.setncatts({**attributes, "_Encoding": "utf-8"})
    encoded = np.array([text.encode() for text in values], f"S{width}")
    variable[:] = encoded.view("S1").reshape(values.size, width)


def chunks(variable, sizes):
    """Chunk sizes: whole planes of one state up to 4 MB; of shapes, whole strips along the control."""
    item = np.dtype(variable.dtype).itemsize
    extra = sizes[4:]
    room = max(1, CHUNK_BYTES // (item * int(np.prod(extra, initial=1))))
    columns = min(sizes[2], room)
    rows = 1 if "s" in variable.dims else max(1, min(sizes[1], room // columns))
    return [1, rows, columns, 1, *extra][: len(sizes)]


def write_failures(dataset, control, failures):
    """The table of points that could not be solved; nothing where there are none."""
    if not failures:
        return
    dataset.createDimension("failure", len(failures))
    for column, name in enumerate(failure_indices(control)):
        variable = dataset.createVariable(name, "i4", ("failure",), fill_value=False, **COMPRESSION)
        variable.long_name = f"position along {name.partition('_')[2]} of a point that failed"
        variable[:] = np.array([failure[column] for failure in failures], "i4")
    reasons = np.array([failure[4] for failure in failures])
    write_labels(dataset, "failure_reason", reasons, {"long_name": "why the point failed"})
