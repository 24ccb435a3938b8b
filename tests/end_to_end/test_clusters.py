"""The same run wherever there are processors: the same dataset, whoever joins, leaves or is a stranger."""

import os
import signal
import time

import dask
import dask_jobqueue  # noqa: F401  (its defaults must be there before a test sets one for itself)
import pytest
from click.testing import CliRunner
from distributed import Security, default_client
from end_to_end.conftest import TOML
from end_to_end.processes import ByHand, elastica

import studies
from studies import Study, StudyError
from studies.command_line import main
from studies.design.request import NUMERICS_VERSION
from studies.running import cluster, dispatch, session
from studies.running.cluster import queued_cluster, running_cluster
from studies.running.worker import Job, check_worker, versions
from studies.store.datasets import identify

STRANGE = "import studies.running.worker; studies.running.worker.versions = lambda: (('numerics', '0'),); "


@pytest.fixture(scope="module")
def by_hand(tmp_path_factory):
    with ByHand(tmp_path_factory.mktemp("by-hand")) as started:
        started.first = started.worker()[0]
        yield started


def names(client):
    """Workers there are, by name."""
    workers = client.scheduler_info(n_workers=-1)["workers"]
    return {str(worker["name"]): address for address, worker in workers.items()}


def wait_for(client, name):
    deadline = time.monotonic() + 120
    while str(name) not in names(client):
        assert time.monotonic() < deadline
        time.sleep(0.05)


def other_than(known, client):
    """Address of a worker that is not among those known; one that is busy starting may come and go."""
    deadline = time.monotonic() + 120
    while not (new := [address for address in names(client).values() if address not in known]):
        assert time.monotonic() < deadline
        time.sleep(0.05)
    return new[0]


@pytest.mark.parametrize(
    "way", ["on this machine", "scheduler by hand, TLS", "jobs of a queue", "array jobs"]
)
def test_every_way_to_run_gives_the_identical_dataset(way, by_hand, study, toml, dataset_file):
    out = toml.with_name("out.nc")
    commands = {
        "on this machine": [("--workers", 2)],
        "scheduler by hand, TLS": [("--scheduler", by_hand.address)],
        "jobs of a queue": [("--cluster", "local", "--workers", 1)],
        "array jobs": [("--shard", "1/2", "--workers", 0), ("--shard", "2/2", "--workers", 0), None],
    }
    job = {"DASK_JOBQUEUE__LOCAL__CORES": "1", "DASK_JOBQUEUE__LOCAL__MEMORY": "1GB"}
    environment = by_hand.environment if "TLS" in way else job
    for options in commands[way]:
        command = ("reduce",) if options is None else ("run", *options)
        run = elastica(command[0], toml, "-o", out, *command[1:], **environment)
        assert run.returncode == 0, run.stderr
    assert identify(out)["content_hash"] == identify(dataset_file)["content_hash"]
    assert sorted(path.name for path in out.parent.iterdir()) == ["out.nc", "small.toml"]


def test_a_worker_that_cannot_do_the_job_is_named_before_anything_runs(by_hand, toml):
    stranger, name = by_hand.worker(STRANGE)
    with by_hand.client() as client:
        wait_for(client, name)
        address = names(client)[str(name)]
        job = Job(None, {}, toml.parent, versions(), None, False, ".probe-nowhere")
        with pytest.raises(StudyError, match=r"worker tls://.*: .*does not see this folder"):
            next(dispatch.dispatch(client, [None], job))
    run = elastica("run", toml, "--scheduler", by_hand.address, **by_hand.environment)
    stranger.kill()
    assert run.returncode == 2
    assert (
        f"worker {address}: a worker has other versions: numerics {NUMERICS_VERSION} here, 0 there"
        in run.stderr
    )
    assert "Traceback" not in run.stderr


def test_workers_leave_and_join_in_the_run(by_hand, tmp_path, monkeypatch, capsys):
    text = TOML.replace("num = 12", "num = 3").replace("max_contacts = 1", 'names = ["0", "U"]')
    (tmp_path / "small.toml").write_text(text.replace("shapes = 11", ""))
    study = Study.from_toml(tmp_path / "small.toml")
    studies.run(study, tmp_path / "whole.nc", workers=0).close()
    whole = identify(tmp_path / "whole.nc")["content_hash"]
    blocks, original = 30, dispatch.dispatch
    with by_hand.client() as client:
        wait_for(client, 1)
        [first] = [address for name, address in names(client).items() if name == "1"]

        def eventful(client, todo, job):
            """Between blocks a worker joins, then a stranger; then the first worker is killed."""
            for number, done in enumerate(original(client, todo, job)):
                if number == 2:
                    by_hand.second = by_hand.worker()[1]
                    wait_for(client, by_hand.second)
                if number == 8:
                    wait_for(client, by_hand.worker(STRANGE)[1])
                if number == 14:
                    by_hand.first.kill()
                yield done

        monkeypatch.setattr(session, "dispatch", eventful)
        monkeypatch.setattr(dispatch, "COUNT_EVERY", 0.0)
        out = tmp_path / "small.nc"
        assert len(study.plan(block_points=1).blocks) == blocks
        studies.run(study, out, client=client, block_points=1).close()
        assert first not in names(client).values()
        assert list(names(client)) == [str(by_hand.second)]
    assert identify(out)["content_hash"] == whole
    told = capsys.readouterr().err
    assert told.count("was sent away, the run goes on without it: a worker has other versions") == 1


def test_a_worker_is_asked_whether_it_sees_the_folder_and_has_the_same_versions(tmp_path):
    with pytest.raises(StudyError, match="does not see this folder"):
        check_worker(tmp_path, ".probe-1", versions())
    (tmp_path / ".probe-1").touch()
    check_worker(tmp_path, ".probe-1", versions())
    with pytest.raises(StudyError, match=f"numerics 0 here, {NUMERICS_VERSION} there, tea 1 here, None"):
        check_worker(tmp_path, ".probe-1", (("numerics", "0"), *versions()[1:], ("tea", "1")))


@pytest.mark.parametrize(
    ("certificates", "sentence"),
    [
        ({}, "tls:// needs certificates, and none are named; name them in distributed.comm.tls"),
        ({"ca": "nowhere.pem"}, "a certificate cannot be read (No such file or directory); mend"),
        ({"ca": "distributed.yaml"}, "a certificate cannot be read (NO_CERTIFICATE_OR_CRL_FOUND); mend"),
        ({"ca": "other.pem"}, "the certificates here and there are not of the same authority; mend"),
    ],
)
def test_certificates_that_are_missing_or_wrong_are_one_sentence(by_hand, certificates, sentence):
    (by_hand.folder / "other.pem").write_text(Security.temporary().tls_ca_file)
    tls = {"ca-file": certificates.get("ca"), "client.cert": "cert.pem", "client.key": "key.pem"}
    named = {
        f"distributed.comm.tls.{key}": f"{by_hand.folder}/{file}" for key, file in tls.items() if certificates
    }
    with (
        dask.config.set(named),
        pytest.raises(StudyError) as problem,
        running_cluster(by_hand.address),
    ):
        pass
    assert str(problem.value).startswith(f"--scheduler {by_hand.address}: {sentence}")


def test_where_nobody_schedules_is_one_sentence(monkeypatch):
    monkeypatch.setattr(cluster, "ANSWER", 0.5)
    with pytest.raises(StudyError, match="no dask scheduler answers"), running_cluster("tcp://127.0.0.1:9"):
        pass


@pytest.mark.parametrize(
    ("sbatch", "job", "sentence"),
    [
        (None, {}, "there is no sbatch here; run where jobs are submitted"),
        ("exit 0", {}, "(You must specify how much cores and memory per job you want to use); describe"),
        ("exit 1", {"cores": 1, "memory": "1GB"}, "(sbatch: invalid partition: tea); describe jobs under"),
    ],
)
def test_jobs_that_cannot_be_submitted_are_one_sentence(tmp_path, monkeypatch, sbatch, job, sentence):
    monkeypatch.setenv("PATH", str(tmp_path))
    if sbatch:
        command = tmp_path / "sbatch"
        command.write_text(f"#!/bin/sh\necho sbatch: invalid partition: tea >&2\n{sbatch}\n")
        command.chmod(0o755)
    settings = {f"jobqueue.slurm.{key}": value for key, value in job.items()}
    with (
        dask.config.set(settings),
        pytest.raises(StudyError) as problem,
        queued_cluster("slurm", 2, tmp_path),
    ):
        pass
    assert str(problem.value).startswith("--cluster slurm: ")
    assert sentence in str(problem.value)
    assert list(tmp_path.glob(".*")) == []


def test_a_job_that_ends_before_the_run_is_submitted_again(tmp_path, monkeypatch):
    monkeypatch.setattr(cluster, "REPLACE_EVERY", 0.2)
    job = {"jobqueue.local.cores": 1, "jobqueue.local.memory": "1GB"}
    with (
        dask.config.set({**job, "distributed.deploy.lost-worker-timeout": "100ms"}),
        queued_cluster("local", 1, tmp_path) as client,
    ):
        address = other_than([], client)
        assert address.startswith("tls://")
        # The user's own dask arrays go where they went before.
        assert dask.config.get("scheduler", None) is None
        with pytest.raises(ValueError, match="No clients found"):
            default_client()
        [process] = [int(job.job_id) for job in client.cluster.workers.values()]
        os.kill(process, signal.SIGKILL)
        other_than([address], client)


def test_options_that_contradict_each_other_are_one_sentence(toml):
    for options, sentence in (
        (["--cluster", "slurm"], "say how many workers to ask for"),
        (["--scheduler", "tcp://127.0.0.1:9", "--workers", "2"], "it has its own workers"),
        (["--scheduler", "tcp://127.0.0.1:9", "--cluster", "pbs"], "it has its own workers"),
    ):
        result = CliRunner().invoke(main, ["run", str(toml), *options])
        assert result.exit_code == 2
        assert sentence in result.output
