"""Copy the numbers of shards into a dataset, chunk by chunk as they are stored: none is compressed twice.

Not here: codes, which are put together anew (`joining`).
"""

import h5py
import numpy as np

from studies.store.access import ACCESS
from studies.store.files import read_labels


def copy_numbers(sources, out, labels, variables):
    """Copy what shards hold of the variables that are numbers.

    Parameters
    ----------
    sources : list of Source
        Shards of rectangles that do not overlap.
    out : Path
        The dataset, in which nothing of these variables is written.
    labels : dict of str to ndarray
        Of the dataset.
    variables : dict of str to Variable
    """
    _, H, prescribed, *_ = labels.values()
    number_of = {str(name): number for number, name in enumerate(labels["ends"])}
    state_of = {str(name): number for number, name in enumerate(labels["state"])}
    numbers = [name for name, variable in variables.items() if variable.dtype == "f8"]
    with ACCESS, h5py.File(out, "r+") as dataset:
        for source in sources:
            first = (
                number_of[source.ends[0]],
                int(np.searchsorted(H, source.H[0])),
                int(np.searchsorted(prescribed, source.prescribed[0])),
            )
            with h5py.File(source.path, "r") as shard:
                states = [state_of.get(name) for name in read_labels(shard["state"], source.path)]
                for name in numbers:
                    if name in shard:
                        _copy(shard[name], dataset[name], first, states)


def _copy(there, here, first, states):
    """Copy a variable of a shard to its place; states that the dataset leaves out have none."""
    if _stored(there) == _stored(here):
        for number in range(there.id.get_num_chunks()):
            offset = there.id.get_chunk_info(number).chunk_offset
            *point, state = offset[:4]
            if states[state] is not None:
                mask, content = there.id.read_direct_chunk(offset)
                place = (*map(sum, zip(first, point, strict=True)), states[state], *offset[4:])
                here.id.write_direct_chunk(place, content, mask)
        return
    # Shards that another version wrote may be stored otherwise.
    rows, columns = (slice(i, i + size) for i, size in zip(first[1:], there.shape[1:3], strict=True))
    for state, place in enumerate(states):
        if place is not None:
            here[first[0], rows, columns, place, *map(slice, there.shape[4:])] = there[0, :, :, state]


def _stored(variable):
    """What must be the same of two variables that exchange chunks: their shape, type and filters."""
    made = variable.id.get_create_plist()
    filters = [made.get_filter(number) for number in range(made.get_nfilters())]
    return variable.chunks, variable.dtype, filters
