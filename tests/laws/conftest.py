import numpy as np
import pytest


@pytest.fixture
def compared(request, full, record_property):
    """Counts, `compared(mask)`, what a law compares over all its examples: too few prove nothing.

    The law says by its mark `at_least` how many it has to compare, of the full counts perhaps more.
    """
    mark = request.node.get_closest_marker("at_least")
    (floor,) = mark.args
    floor = mark.kwargs.get("full", floor) if full else floor
    counts = []
    yield lambda cases: counts.append(int(np.count_nonzero(cases)))
    record_property("compared", sum(counts))
    assert sum(counts) >= floor, f"only {sum(counts)} cases were compared of {len(counts)} examples"
