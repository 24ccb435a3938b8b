"""Shards hold chunks of the dataset, which are copied as they are; it is the same however it is cut."""

from dataclasses import replace

import h5py
import numpy as np
import pytest
from end_to_end.conftest import CONTENT

from studies import Study, StudyError
from studies.design import plan as planning
from studies.design.plan import Plan
from studies.running.runner import compute, join
from studies.running.session import Policy
from studies.store import joining, layout
from studies.store.datasets import identify
from studies.store.files import opened
from studies.store.shards import find_shards, folder_of

HERE, ALL = Policy(workers=0), Policy(workers=0, part=(1, 1))
GRID = CONTENT["grid"] | {"H": [0.05, 0.1, 0.2], "P": {"start": 0.2, "stop": 9.0, "num": 7}}


@pytest.fixture(scope="module")
def study():
    """Both ends have states of one contact in some blocks only; 7 loads do not divide evenly."""
    return Study.from_dict(CONTENT | {"grid": GRID})


@pytest.fixture(scope="module")
def uncut(study, tmp_path_factory):
    """Content of the dataset whose blocks are too small to have chunks of their own."""
    out = tmp_path_factory.mktemp("uncut") / "small.nc"
    plan = Plan.of(study, block_points=1)
    assert plan.tile is None
    compute(plan, out, HERE)
    return identify(out)["content_hash"]


CUTS = {
    "the whole grid": ([1000, 1000], (3, 7)),
    "whole rows": ([14, 14], (2, 7)),
    "of other ends more rows": ([7, 20], (1, 7)),
    "parts of rows": ([5, 5], (1, 4)),
    "of other ends whole rows": ([4, 18], (1, 4)),
    "of other ends larger parts": ([2, 5], (1, 2)),
}


@pytest.fixture(params=CUTS)
def plan(request, study, monkeypatch):
    sizes, tile = CUTS[request.param]
    monkeypatch.setattr(planning, "LEAST_TILE", 2)
    of_ends = iter(sizes)
    monkeypatch.setattr(planning, "_block_points", lambda *_: next(of_ends))
    made = Plan.of(study)
    assert made.tile == tile
    return made


def chunks_of(variable):
    """Stored bytes by place."""
    infos = [variable.id.get_chunk_info(number) for number in range(variable.id.get_num_chunks())]
    return {info.chunk_offset: variable.id.read_direct_chunk(info.chunk_offset)[1] for info in infos}


def test_chunks_are_copied_as_they_are(plan, uncut, tmp_path):
    out = tmp_path / "small.nc"
    compute(plan, out, ALL)
    kept = {}
    for block, path in find_shards(folder_of(out), plan.blocks, plan.identity).items():
        with h5py.File(path) as shard:
            kept[block] = {name: chunks_of(shard[name]) for name in ("energy", "reaction", "theta")}
    join(plan, out)
    assert identify(out)["content_hash"] == uncut
    with h5py.File(out) as dataset:
        for name in ("energy", "reaction", "theta"):
            stored = set(chunks_of(dataset[name]).values())
            # Shards also have states that are nowhere solved, which the dataset leaves out.
            assert stored and stored <= {
                content for block in kept.values() for content in block[name].values()
            }
            assert dataset[name].chunks[1:3] == plan.tile


@pytest.mark.parametrize("tile", [None, (1, 7)])
def test_shards_that_are_stored_otherwise_are_joined_all_the_same(study, uncut, tmp_path, monkeypatch, tile):
    monkeypatch.setattr(planning, "LEAST_TILE", 2)
    plan, out = Plan.of(study, block_points=14), tmp_path / "small.nc"
    compute(replace(plan, tile=tile), out, ALL)
    join(plan, out)
    assert identify(out)["content_hash"] == uncut


def test_a_shard_that_is_damaged_while_it_is_joined_is_found(study, uncut, tmp_path, monkeypatch):
    monkeypatch.setattr(planning, "LEAST_TILE", 2)
    plan, out = Plan.of(study, block_points=14), tmp_path / "small.nc"
    compute(plan, out, ALL)

    def damaging(sources, grid):
        with h5py.File(sources[1].path) as shard:
            info = shard["theta"].id.get_chunk_info(0)
        content = bytearray(sources[1].path.read_bytes())
        content[info.byte_offset + info.size // 2] ^= 1
        sources[1].path.write_bytes(content)
        return surveying(sources, grid)

    surveying = joining.survey
    monkeypatch.setattr("studies.running.runner.survey", damaging)
    with pytest.raises(StudyError, match="damaged while"):
        join(plan, out)
    assert not out.exists()
    monkeypatch.undo()
    monkeypatch.setattr(planning, "LEAST_TILE", 2)
    compute(plan, out, HERE)
    assert identify(out)["content_hash"] == uncut


def test_strips_of_many_samples_are_joined_and_hashed_in_pieces(study, tmp_path, monkeypatch):
    whole, pieces = tmp_path / "whole.nc", tmp_path / "pieces.nc"
    plan = Plan.of(study, block_points=1)
    compute(plan, whole, HERE)
    monkeypatch.setattr(joining, "GROUP_BYTES", 1)
    monkeypatch.setattr(layout, "CHUNK_BYTES", 2 * 11 * 8)
    monkeypatch.setattr("studies.store.content.BAND_BYTES", 1)
    compute(plan, pieces, HERE)
    with opened(pieces) as dataset:
        assert dataset.variables["theta"].chunking() == [1, 1, 2, 1, 11]
    assert identify(pieces)["content_hash"] == identify(whole)["content_hash"]


@pytest.mark.parametrize("size", [1, 5, 255, 256, 1000, 20_000])
@pytest.mark.parametrize("loads", [1, 7, 256, 1000])
def test_every_block_consists_of_whole_tiles(size, loads):
    grid = CONTENT["grid"] | {"H": {"start": 0.04, "stop": 0.2, "num": 30}}
    grid |= {"P": np.linspace(0.2, 9.0, loads).tolist()}
    plan = Study.from_dict(CONTENT | {"grid": grid}).plan(block_points=size)
    assert sum(block.points for block in plan.blocks) == plan.points
    if plan.tile is None:
        assert min(size, plan.points // 2) < 2 * planning.LEAST_TILE
        return
    for block in plan.blocks:
        extent = zip(block.place[1:], block.shape[1:], plan.tile, (30, loads), strict=True)
        for first, count, step, most in extent:
            assert first % step == 0 and (count % step == 0 or first + count == most)
