"""Whether an HDF5 file keeps its values to itself: looked at before anything in it is followed.

HDF5 can do more than a dataset needs. A variable may lie in another file, be put together from others, or
be decoded by a library that is loaded for it; groups may be nested without end. A file that somebody else
wrote must not make its reader open a third one.

Not here: what the variables mean (`structure`).
"""

from math import prod

import h5py
from h5py import h5a, h5d, h5g, h5l, h5o, h5s, h5t, h5z

from studies.messages import shown

MOST_VARIABLES, MOST_ATTRIBUTES, MOST_TEXTS = 200, 200, 100
"""In the file, of a variable, in an attribute."""
LONGEST_NAME = 255
"""Bytes, as in netCDF, whose library crashes beyond."""
CHUNK_BYTES, ATTRIBUTE_BYTES = 1 << 28, 1 << 24
"""Read at once: of a chunk or the labels of a dimension, of an attribute."""
FILTERS = {h5z.FILTER_DEFLATE, h5z.FILTER_SHUFFLE, h5z.FILTER_FLETCHER32}
"""Those for which no library is looked for."""
LABELS = {
    b"ends",
    b"state",
    b"failure_reason",
    b"transition_ends",
    b"transition_state",
    b"transition_other_state",
}
"""The variables that are text; other programs store characters as texts of any length."""
MOST_LABELS = 10_000
SIMPLE = {h5t.INTEGER, h5t.FLOAT, h5t.STRING}
SCALES = {b"DIMENSION_LIST", b"REFERENCE_LIST"}
"""Where netCDF keeps which dimensions a variable has: the only references there are."""


def foreign(path):
    """The first thing in a file that no dataset has, and that is not safe to follow.

    Parameters
    ----------
    path : str or Path

    Returns
    -------
    str or None
        In words; None if the file is plain.

    Raises
    ------
    OSError, RuntimeError, ValueError, KeyError
        If it is no HDF5 file, or damaged.
    """
    with h5py.File(path, "r") as file:
        root = h5g.open(file.id, b"/")
        if len(root) > MOST_VARIABLES:
            return f"it has {len(root):,} variables"
        problems = [_of_attributes(root, "the file"), *(_of_member(root, name) for name in root)]
    return next(filter(None, problems), None)


def _of_member(root, name):
    """What is foreign in one of the links of the file."""
    words = shown(name.decode(errors="replace"))
    if len(name) > LONGEST_NAME:
        return f"the name {words} is too long"
    if root.links.get_info(name).type != h5l.TYPE_HARD:
        return f"{words} is a link to another place"
    if h5o.get_info(root, name).type != h5o.TYPE_DATASET:
        return f"{words} is a group or a type, and no variable"
    variable = h5d.open(root, name)
    if variable.get_space().get_simple_extent_type() == h5s.NULL:
        return f"{words} has no values"
    stored, kind = variable.get_create_plist(), variable.get_type()
    layout = stored.get_layout()
    if layout == h5d.VIRTUAL or stored.get_external_count():
        return f"the values of {words} lie in other files"
    labels = name in LABELS and len(variable.shape) <= 1 and prod(variable.shape) <= MOST_LABELS
    if kind.get_class() not in SIMPLE or (_varies(kind) and not labels):
        return f"{words} has values of a type that no dataset has"
    if {stored.get_filter(number)[0] for number in range(stored.get_nfilters())} - FILTERS:
        return f"{words} is stored with a filter that is not part of HDF5"
    at_once = stored.get_chunk() if layout == h5d.CHUNKED else ()
    if len(variable.shape) <= 2:
        at_once = max(at_once, variable.shape, key=prod)
    if prod(at_once) * kind.get_size() > CHUNK_BYTES:
        return f"{words} has to be read in pieces of {prod(at_once) * kind.get_size():,} bytes"
    return _of_attributes(variable, words)


def _of_attributes(owner, words):
    """What is foreign in the attributes of a variable or of the file."""
    count = h5a.get_num_attrs(owner)
    if count > MOST_ATTRIBUTES:
        return f"{words} has {count:,} attributes"
    for number in range(count):
        attribute = h5a.open(owner, index=number)
        kind, name = attribute.get_type(), shown(attribute.name.decode(errors="replace"))
        if len(attribute.name) > LONGEST_NAME:
            return f"the name {name} of an attribute of {words} is too long"
        if attribute.get_space().get_simple_extent_type() == h5s.NULL:
            return f"the attribute {name} of {words} has no value"
        size = prod(attribute.shape)
        if kind.get_class() not in SIMPLE and attribute.name not in SCALES:
            return f"the attribute {name} of {words} is neither text nor numbers"
        # Texts of any length may all be the same one, which is read again for each.
        if size * kind.get_size() > ATTRIBUTE_BYTES or (_varies(kind) and size > MOST_TEXTS):
            return f"the attribute {name} of {words} is too large"
    return None


def _varies(kind):
    """Whether values are texts whose length is not part of the type."""
    return kind.get_class() == h5t.STRING and kind.is_variable_str()
