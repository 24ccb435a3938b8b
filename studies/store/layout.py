"""How a dataset is laid out in a netCDF file: dimensions, text as characters, chunks, the table of failures.

Not here: what the variables mean (`schema`), the files themselves (`files`).
"""

from math import prod

import numpy as np

from studies.schema import COORDINATES, failure_indices

CHUNK_BYTES = 4_000_000
"""Of a chunk, at the most."""
COMPRESSION = {"zlib": True, "complevel": 4, "shuffle": True, "fletcher32": True}


def define(dataset, labels, variables, attributes, tile):
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
    tile : (int, int) or None
        Rows and columns of the grid that make a chunk, compressed and with checksums; None for neither.
    """
    filters = COMPRESSION if tile else {}
    # Only along dimensions without an end are chunks longer than these.
    least = dict(zip(list(labels)[1:3], tile or (), strict=False))
    for dim, values in labels.items():
        dataset.createDimension(dim, values.size if values.size >= least.get(dim, 0) else None)
        write_labels(dataset, dim, values, COORDINATES[dim], filters)
    for name, variable in variables.items():
        sizes = [labels[dim].size for dim in variable.dims]
        created = dataset.createVariable(
            name,
            variable.dtype,
            variable.dims,
            chunksizes=chunks(variable, sizes, tile) if tile else None,
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


def whole_planes(grid):
    """The tile where blocks have none: planes of numbers up to 4 MB, in whole rows if they can."""
    room = CHUNK_BYTES // 8
    columns = min(len(grid.prescribed), room)
    return max(1, min(len(grid.H), room // columns)), columns


def chunks(variable, sizes, tile):
    """Chunk sizes: a tile of one state and one contact; of more than 4 MB a part, of which it has many."""
    rows, columns = tile
    extra = [1 if dim == "contact" else size for dim, size in zip(variable.dims, sizes, strict=True)][4:]
    room = max(1, CHUNK_BYTES // (np.dtype(variable.dtype).itemsize * prod(extra)))
    if columns > room:
        columns = 1 << (room.bit_length() - 1)
    rows = max(
        part for part in range(1, rows + 1) if rows % part == 0 and (part == 1 or part * columns <= room)
    )
    return [1, rows, columns, 1, *extra][: len(sizes)]


def write(target, place, values):
    """Write values of each state at some ends, rows and columns; chunks with nothing in them are left out."""
    apart = 5 if "contact" in target.dimensions else 4
    for among in np.ndindex(values.shape[3:apart]):
        plane = values[:, :, :, *among]
        if plane.dtype != "f8" or not np.isnan(plane).all():
            target[(*place, *among)] = plane


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
