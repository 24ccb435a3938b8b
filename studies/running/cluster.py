"""Clusters of dask workers: started by somebody else, or jobs of a queueing system.

What they compute is not their concern (`dispatch`), and what else the user computes with dask is not theirs.
Addresses are loopback unless the user names another; traffic that leaves the machine can be encrypted, and
that of jobs always is.

Not here: workers on this machine (`local`).
"""

import logging
from contextlib import ExitStack, contextmanager
from importlib import import_module
from pathlib import Path
from shutil import which
from tempfile import TemporaryDirectory

from studies.errors import StudyError
from studies.whole_files import PART

QUEUES = {
    "slurm": "SLURMCluster",
    "pbs": "PBSCluster",
    "sge": "SGECluster",
    "lsf": "LSFCluster",
    "oar": "OARCluster",
    "moab": "MoabCluster",
    "htcondor": "HTCondorCluster",
    "local": "local.LocalCluster",
}
"""Queueing systems by the names of their sections in jobqueue.yaml; `local` stands in for one in tests."""
ANSWER = 10.0
"""Seconds within which a scheduler must answer."""
REPLACE_EVERY = 30.0
"""Seconds between looks for jobs that have ended."""
SHORT_LOGS = {"distributed.admin.low-level-log-length": 20}
"""Clients and schedulers log the last messages; with the labels of 10,000 points each they take 0.5 GB."""
CERTIFICATES = (
    "distributed.comm.tls in ~/.config/dask/distributed.yaml, or DASK_DISTRIBUTED__COMM__TLS__CA_FILE, "
    "…__CLIENT__CERT and …__CLIENT__KEY"
)
"""Where dask looks for the certificates of a client."""
TALKATIVE = ("asyncio", "distributed", "distributed.client", "distributed.core", "tornado.application")


@contextmanager
def running_cluster(address):
    """A client of a scheduler that is already there; of tls:// with the certificates dask is configured for.

    Raises
    ------
    StudyError
        If no scheduler answers, or the two do not trust each other.
    """
    import dask
    from distributed import Client

    # A scheduler that is lost is told in one sentence; these would add pages on the way.
    for name in TALKATIVE:
        logging.getLogger(name).setLevel(logging.CRITICAL)
    try:
        with dask.config.set(SHORT_LOGS):
            client = Client(address, timeout=ANSWER, set_as_default=False)
    except (OSError, ValueError, TypeError) as problem:
        raise StudyError(f"--scheduler {address}: {_why_no_client(problem)}") from None
    with client:
        yield client


def _why_no_client(problem):
    """What keeps a client from its scheduler, and what to change."""
    from ssl import SSLError

    from distributed.comm.core import FatalCommClosedError

    if isinstance(problem, TypeError):
        return f"tls:// needs certificates, and none are named; name them in {CERTIFICATES}"
    if isinstance(problem, (SSLError, FileNotFoundError, PermissionError)):
        reason = getattr(problem, "reason", problem.strerror)
        return f"a certificate cannot be read ({reason}); mend {CERTIFICATES}"
    if isinstance(problem, FatalCommClosedError):
        return f"the certificates here and there are not of the same authority; mend {CERTIFICATES}"
    return f"no dask scheduler answers there ({problem})"


@contextmanager
def queued_cluster(queue, workers, folder):
    """A client of workers that run as jobs of a queueing system, which end with the block.

    What a job is (its cores, memory, walltime, account) stands in dask's `jobqueue.yaml`.

    Parameters
    ----------
    queue : str
        One of `QUEUES`.
    workers : int
        How many to ask for.
    folder : Path
        That all machines see, of the shards: certificates made for this run are there, unless dask is
        configured with some.

    Raises
    ------
    StudyError
        If dask-jobqueue is missing, not configured, or no job can be submitted.
    """
    import dask
    from distributed import Client

    place, _, name = f"dask_jobqueue.{QUEUES[queue]}".rpartition(".")
    try:
        import_module("cryptography")
        kind = getattr(import_module(place), name)
    except ImportError as problem:
        raise StudyError(
            f"--cluster {queue}: {problem.name} is missing; pip install 'constrained-elastica[cluster]'"
        ) from None
    submit = (kind.job_cls.submit_command or "").partition(" ")[0]
    if submit and which(submit) is None:
        raise StudyError(f"--cluster {queue}: there is no {submit} here; run where jobs are submitted")
    settings = dask.config.get(f"jobqueue.{queue}.scheduler-options", {})
    with ExitStack() as stack:
        try:
            stack.enter_context(dask.config.set(SHORT_LOGS))
            security = stack.enter_context(_encryption(folder))
            cluster = stack.enter_context(
                kind(
                    security=security,
                    scheduler_options={"dashboard_address": "127.0.0.1:0", **settings},
                    silence_logs="critical",
                )
            )
            client = stack.enter_context(Client(cluster, set_as_default=False))
            stack.enter_context(_jobs(cluster, workers))
        except (ValueError, RuntimeError) as problem:
            lines = [line for line in str(problem).splitlines() if line.strip()]
            reason = lines[-1] if isinstance(problem, RuntimeError) else lines[0].partition(", for")[0]
            raise StudyError(
                f"--cluster {queue}: no job can be submitted ({reason}); describe jobs under "
                f"jobqueue: {queue}: in ~/.config/dask/jobqueue.yaml"
            ) from None
        yield client


@contextmanager
def _encryption(folder):
    """The certificates that dask is configured for, or some for this run, in files of the user alone."""
    import dask
    from distributed import Security

    # The command line reads the names of the queues above: solving a state must not wait for netCDF.
    from studies.store.shards import OF_CLUSTER

    if dask.config.get("distributed.comm.tls.ca-file", None):
        yield Security(require_encryption=True)
        return
    made = Security.temporary()
    with TemporaryDirectory(prefix=OF_CLUSTER, suffix=PART, dir=folder.resolve()) as place:
        paths = {}
        for part, text in (
            ("ca", made.tls_ca_file),
            ("cert", made.tls_client_cert),
            ("key", made.tls_client_key),
        ):
            path = Path(place) / f"{part}.pem"
            path.write_text(text)
            paths[part] = str(path)
        of_roles = {
            f"tls_{role}_{part}": paths[part]
            for role in ("client", "scheduler", "worker")
            for part in ("cert", "key")
        }
        yield Security(require_encryption=True, tls_ca_file=paths["ca"], **of_roles)


@contextmanager
def _jobs(cluster, workers):
    """Submit jobs; those that reach their walltime are submitted again."""
    from distributed.core import Status
    from tornado.ioloop import PeriodicCallback

    async def submit():
        cluster.scale(workers)
        try:
            # What `scale` starts in the background would fail there unheard.
            await cluster._correct_state()
        except Exception:
            for job in cluster.workers.values():
                # A cluster with jobs that were never submitted does not close.
                job.status = Status.failed if job.job_id is None else job.status
            raise

    cluster.sync(submit)
    again = PeriodicCallback(lambda: cluster.scale(workers), REPLACE_EVERY * 1000)
    cluster.loop.add_callback(again.start)
    try:
        yield
    finally:
        cluster.loop.add_callback(again.stop)
