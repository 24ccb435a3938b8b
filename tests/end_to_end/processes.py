"""The `elastica` command in processes of its own, as a user or a cluster starts it."""

import os
import subprocess
import sys
from pathlib import Path

COMMAND = [sys.executable, "-c", "from studies.command_line import main; main()"]
POISON = Path(__file__).parents[1] / "poison"


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
    path = os.pathsep.join([str(POISON), *filter(None, [os.environ.get("PYTHONPATH")])])
    return {"PYTHONPATH": path, "POISON": death, "POISON_POINT": f"{ends} {H} {P}"}
