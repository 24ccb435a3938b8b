"""Disks that are full, read-only or that forget: one clear sentence, and nothing that was there is lost."""

import os
import shutil
import subprocess

import pytest
from end_to_end.processes import COMMAND

from studies.running.runner import compute
from studies.running.session import Policy
from studies.store.datasets import identify
from studies.store.shards import find_shards, folder_of


def on_a_disk(options, script, folder):
    """Run shell commands in a name space of mounts where `disk` is one of memory."""
    (folder / "disk").mkdir()
    mount = f"mount -t tmpfs -o {options} tmpfs disk"
    return subprocess.run(
        ["unshare", "--map-root-user", "--user", "--mount", "sh", "-c", f"{mount} && {script}"],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=300,
    )


RUN = f"{COMMAND[0]} -c '{COMMAND[2]}' run small.toml -o disk/small.nc"


@pytest.mark.parametrize("workers", ["", "--workers 0", "--workers 2"])
def test_a_full_disk_keeps_what_is_computed_and_the_run_goes_on_later(toml, tmp_path, dataset_file, workers):
    """Room for some kilobytes, then for all: the second command uses what the first has left."""
    more = "mount -o remount,size=10m disk"
    script = f"{RUN} {workers}; echo status $?; ls -A disk/*.shards; {more} && {RUN} && cp disk/small.nc ."
    result = on_a_disk("size=72k", script, tmp_path)
    assert result.returncode == 0, result.stderr
    assert "status 2" in result.stdout
    first = result.stderr.splitlines()[0]
    assert first.startswith("Error: ")
    assert "kept" in first
    assert "Traceback" not in result.stderr
    assert ".part" not in result.stdout
    assert identify(tmp_path / "small.nc")["content_hash"] == identify(dataset_file)["content_hash"]


def test_a_disk_too_small_for_the_dataset_keeps_every_block(toml, tmp_path, dataset_file):
    more = "mount -o remount,size=10m disk"
    room = dataset_file.stat().st_size // 2048
    less = f"mount -o remount,size=$(($(du -sk disk | cut -f1) + {room}))k disk"
    script = (
        f"{RUN} --shard 1/1 2>/dev/null && {less}; "
        f"{RUN}; echo status $?; ls -A disk/*.shards; {more} && {RUN} && cp disk/small.nc ."
    )
    result = on_a_disk("size=10m", script, tmp_path)
    assert result.returncode == 0, result.stderr
    assert "status 2" in result.stdout
    assert result.stderr.startswith("Error: disk/small.nc: this cannot be written")
    assert result.stdout.count(".nc\n") >= 2
    assert identify(tmp_path / "small.nc")["content_hash"] == identify(dataset_file)["content_hash"]


def test_a_read_only_folder_is_one_sentence(toml, tmp_path):
    result = on_a_disk("ro", f"{RUN}; echo status $?; ls -A disk", tmp_path)
    assert result.stdout == "status 2\n"
    assert "cannot be written to" in result.stderr
    assert result.stderr.count("\n") == 1


def test_every_bit_of_a_shard_counts(study, tmp_path, rng):
    """Flipped bits, zeroed stretches and missing ends are found without opening the file."""
    plan, out = study.plan(block_points=60), tmp_path / "small.nc"
    compute(plan, out, Policy(workers=0, part=(1, 2)))
    folder = folder_of(out)
    [shard] = find_shards(folder, plan.blocks, study.identity).values()
    good = shard.read_bytes()
    for flip in range(200):
        content = bytearray(good)
        place = int(rng.integers(len(good)))
        if flip % 4 == 3:
            content[place : place + 64] = bytes(len(content[place : place + 64]))
        else:
            content[place] ^= 1 << int(rng.integers(8))
        shard.write_bytes(content)
        intact = find_shards(folder, plan.blocks, study.identity)
        assert (intact == {}) == (bytes(content) != good)
    shard.write_bytes(good[:-1])
    assert find_shards(folder, plan.blocks, study.identity) == {}
    shard.write_bytes(good)
    assert len(find_shards(folder, plan.blocks, study.identity)) == 1


def test_a_damaged_shard_in_the_place_of_a_good_one_is_computed_again(study, dataset_file, tmp_path):
    plan, out = study.plan(block_points=24), tmp_path / "small.nc"
    compute(plan, out, Policy(workers=0, part=(1, 1)))
    shards = list(find_shards(folder_of(out), plan.blocks, study.identity).values())
    # That of another place, with a good seal.
    shutil.copy(shards[1], shards[0].with_name(shards[0].name[:-35] + shards[1].name[-35:]))
    shards[0].unlink()
    shards[2].write_bytes(b"")
    compute(plan, out, Policy(workers=0))
    assert identify(out)["content_hash"] == identify(dataset_file)["content_hash"]


def test_a_clock_that_goes_backwards_changes_nothing(study, dataset_file, tmp_path, monkeypatch):
    import time

    plan, out = study.plan(block_points=24), tmp_path / "small.nc"
    compute(plan, out, Policy(workers=0, part=(1, 2)))
    monkeypatch.setattr(time, "time", lambda: 0.0)
    for shard in folder_of(out).iterdir():
        os.utime(shard, (4e9, 4e9))
    compute(plan, out, Policy(workers=0))
    assert identify(out)["content_hash"] == identify(dataset_file)["content_hash"]
