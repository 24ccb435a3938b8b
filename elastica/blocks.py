"""Many points are computed a block at a time, so that what is in work stays in the cache of a processor.

Operations are element-wise: the size of a block changes no value.
"""

POINTS = 12_000
"""Of a block: an array of so many numbers is 96 kB."""


def blocks(size):
    """Slices of at most `POINTS` that together are `size` points."""
    return [slice(start, min(start + POINTS, size)) for start in range(0, size, POINTS)]
