"""The `elastica` command in processes of its own, as a user or a cluster starts it."""

import json
import os
import subprocess
import sys
import time
from pathlib import Path

from distributed import Client, Security

TESTS = Path(__file__).parents[1]
COMMAND = [sys.executable, "-c", "from studies.command_line import main; main()"]
MAIN = "import sys; from distributed.cli.{0} import main; main(sys.argv[1:])"
TLS = """
distributed:
  comm:
    require-encryption: true
    tls:
      ca-file: {0}/ca.pem
      scheduler: {{cert: {0}/cert.pem, key: {0}/key.pem}}
      worker: {{cert: {0}/cert.pem, key: {0}/key.pem}}
      client: {{cert: {0}/cert.pem, key: {0}/key.pem}}
"""


def elastica(*arguments, cwd=None, timeout=300, **environment):
    """Run a command to its end."""
    return subprocess.run(
        [*COMMAND, *map(str, arguments)],
        cwd=cwd,
        capture_output=True,
        text=True,
        timeout=timeout,
        env=os.environ | environment,
    )


def start(*arguments, cwd=None, **environment):
    """Begin a command, in a group of its own."""
    return subprocess.Popen(
        [*COMMAND, *map(str, arguments)],
        cwd=cwd,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=os.environ | environment,
        start_new_session=True,
    )


def poisoned(death, ends, H, P):
    """Environment in which one point is deadly."""
    return {**_loading("poison"), "POISON": death, "POISON_POINT": f"{ends} {H} {P}"}


def witnessed(file):
    """Environment in which blocks that are begun and done are written down."""
    return {**_loading("witness"), "WITNESS": str(file)}


def _loading(folder):
    """Environment in which Python begins with the code of a folder."""
    return {
        "PYTHONPATH": os.pathsep.join([str(TESTS / folder), *filter(None, [os.environ.get("PYTHONPATH")])])
    }


class ByHand:
    """A scheduler and workers, each a process of its own, that talk through TLS."""

    def __init__(self, folder, **environment):
        self.folder, self.processes, self.count = folder, [], 0
        made = Security.temporary()
        for name, text in (
            ("ca", made.tls_ca_file),
            ("cert", made.tls_client_cert),
            ("key", made.tls_client_key),
        ):
            (folder / f"{name}.pem").write_text(text)
        (folder / "distributed.yaml").write_text(TLS.format(folder))
        self.environment = environment | {"DASK_CONFIG": str(folder)}
        file = folder / "scheduler.json"
        options = ["--host", "tls://127.0.0.1", "--port", "0", "--scheduler-file", file]
        self.scheduler = self.start("", "dask_scheduler", *options)
        deadline = time.monotonic() + 120
        while not file.exists() and time.monotonic() < deadline:
            time.sleep(0.05)
        self.address = json.loads(file.read_text())["address"]

    def start(self, before, program, *options):
        command = [sys.executable, "-c", before + MAIN.format(program), *map(str, options), "--no-dashboard"]
        silent = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        self.processes.append(subprocess.Popen(command, env=os.environ | self.environment, **silent))
        return self.processes[-1]

    def worker(self, before="", nanny="--no-nanny"):
        """Start a worker: its process and its name."""
        self.count += 1
        options = ["--nthreads", 1, nanny, "--name", self.count, "--local-directory", self.folder / "dask"]
        return self.start(before, "dask_worker", self.address, *options), self.count

    def client(self):
        ca, cert, key = (f"{self.folder}/{name}.pem" for name in ("ca", "cert", "key"))
        security = Security(require_encryption=True, tls_ca_file=ca, tls_client_cert=cert, tls_client_key=key)
        return Client(self.address, security=security, set_as_default=False)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        # Workers whose scheduler has gone may take minutes to end of themselves.
        for process in self.processes:
            process.kill()
            process.wait()
