"""The tree that refines a grid, on maps of which every point is known."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from studies.design.axes import Refine
from studies.design.refinement import UNKNOWN, first_points, next_points

SHAPE = 65, 129


def refined(dense, refine):
    """What a refinement learns of a map, and the rounds it takes; no point is asked for twice."""
    codes = np.full(dense.shape, UNKNOWN, "i4")
    wanted, rounds = first_points(dense.shape, refine), 0
    while wanted.any():
        assert (codes[wanted] == UNKNOWN).all()
        codes[wanted] = dense[wanted]
        wanted, rounds = next_points(codes, refine), rounds + 1
    return codes, rounds


def nearest(codes):
    """The map that a chart makes of the points known."""
    known = np.argwhere(codes != UNKNOWN)
    everywhere = np.argwhere(np.ones_like(codes, bool))
    return codes[tuple(known[cKDTree(known).query(everywhere)[1]].T)].reshape(codes.shape)


def disc(row, column, radius):
    i, j = np.indices(SHAPE)
    return ((i - row) ** 2 + (j - column) ** 2 <= radius**2).astype(int)


@pytest.mark.parametrize("levels", [1, 2, 3, 4])
def test_a_boundary_is_found_to_the_finest_step_with_few_points(levels):
    dense = disc(30.3, 60.7, 25) + 2 * disc(64, 128, 40)
    codes, rounds = refined(dense, Refine(levels=levels))
    assert np.array_equal(nearest(codes), dense)
    assert (codes != UNKNOWN).sum() < (0.6, 0.4, 0.25, 0.25)[levels - 1] * codes.size
    assert rounds <= 2 * levels + 1
    edges = (dense[1:] != dense[:-1]) & (codes[1:] != UNKNOWN) & (codes[:-1] != UNKNOWN)
    assert np.array_equal(edges, dense[1:] != dense[:-1])


def test_a_map_without_boundaries_costs_the_coarse_grid_and_the_audit():
    codes, rounds = refined(np.zeros(SHAPE, int), Refine(levels=3, audit=2))
    corners = np.zeros(SHAPE, bool)
    corners[::8, ::8] = True
    assert rounds == 1
    assert (codes[corners] == 0).all()
    audited = ((codes != UNKNOWN) & ~corners)[:-1, :-1].reshape(8, 8, 16, 8).sum(axis=(1, 3))
    assert set(np.unique(audited)) <= {1, 2}
    assert (audited == 2).sum() > 100
    assert (refined(np.zeros(SHAPE, int), Refine(levels=3, audit=0))[0] != UNKNOWN).sum() == corners.sum()


def test_the_audit_finds_an_island_that_the_tree_alone_misses():
    tree, audited = Refine(levels=4, audit=0), Refine(levels=4, audit=1)
    extra = np.argwhere(first_points(SHAPE, audited) & ~first_points(SHAPE, tree))
    row, column = extra[len(extra) // 2]
    dense = disc(row, column, 3)
    dense[::16, ::16] = 0
    assert not nearest(refined(dense, tree)[0]).any()
    assert np.array_equal(nearest(refined(dense, audited)[0]), dense)


def test_a_strip_thinner_than_the_coarse_cells_is_followed_from_one_find():
    dense = np.zeros(SHAPE, int)
    dense[20:24] = 1
    tree = Refine(levels=4, audit=0)
    assert not refined(dense, tree)[0].max()
    dense[32, 64] = 1
    dense[20:33, 64] = 1
    assert np.array_equal(nearest(refined(dense, tree)[0]), dense)
