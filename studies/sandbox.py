"""Calls in a process of their own, which may crash or never return: that costs the call, not the run.

Each thread keeps one such process and starts another when it is lost. The process watches itself: a timer
that needs no Python ends it at the limit, and it ends with the process that started it.
"""

import faulthandler
import os
import pickle
import queue
import signal
import subprocess
import sys
import threading
import time

SERVE = "from studies.sandbox import serve; serve()"
MALLOC = {"MALLOC_TRIM_THRESHOLD_": str(1 << 28), "MALLOC_MMAP_THRESHOLD_": str(1 << 28)}
"""Freed memory returned at the default of 128 kB costs a third of the time in page faults."""
OWN = threading.local()


class Lost(Exception):
    """The process did not survive a call; the message says how it ended."""


def call(function, *arguments, limit):
    """Call a function in another process.

    Parameters
    ----------
    function : callable
        Of a module, as are the types of its arguments and of its result.
    *arguments
    limit : float
        Seconds after which the call is given up.

    Returns
    -------
    object
        What the function returns. What it raises is raised.

    Raises
    ------
    Lost
        If the process crashed, was killed, or did not answer in time.
    """
    process = getattr(OWN, "process", None)
    if process is None or process.poll() is not None:
        process = OWN.process = _start()
    start = time.monotonic()
    try:
        pickle.dump((function, arguments, limit), process.stdin)
        process.stdin.flush()
        good, answer = pickle.load(process.stdout)
    except (EOFError, BrokenPipeError, pickle.UnpicklingError):
        status = process.wait()
        _end(process)
        raise Lost(_cause_of_death(status, time.monotonic() - start, limit)) from None
    except BaseException:
        # Its answer would be taken for that of the next call.
        _end(process)
        raise
    if good:
        return answer
    raise answer


def _start():
    path = os.pathsep.join(entry for entry in sys.path if entry)
    return subprocess.Popen(
        [sys.executable, "-P", "-c", SERVE],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        env={**MALLOC, **os.environ, "PYTHONPATH": path},
        # Ctrl-C reaches every process of the terminal's group.
        process_group=0,
    )


def _end(process):
    OWN.process = None
    process.kill()
    process.wait()
    for stream in (process.stdin, process.stdout):
        try:
            stream.close()
        except BrokenPipeError:
            continue


def _cause_of_death(status, seconds, limit):
    if seconds >= limit:
        return f"no answer within {limit:g} s"
    if status == -signal.SIGKILL:
        return "the process was killed (SIGKILL), perhaps for want of memory"
    if status < 0:
        return f"the process crashed ({signal.Signals(-status).name})"
    return f"the process ended with status {status}"


def serve():
    """Answer calls until the process that asks is gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    answers = os.fdopen(os.dup(1), "wb")
    # What a library prints must not be taken for an answer.
    os.dup2(2, 1)
    calls = queue.SimpleQueue()
    threading.Thread(target=_listen, args=(calls,), daemon=True).start()
    with open(os.devnull, "w") as nowhere:
        while True:
            function, arguments, limit = calls.get()
            faulthandler.dump_traceback_later(limit, exit=True, file=nowhere)
            answer = _answer(function, arguments)
            faulthandler.cancel_dump_traceback_later()
            try:
                answers.write(answer)
                answers.flush()
            except BrokenPipeError:
                os._exit(0)


def _listen(calls):
    """Pass calls on; end the process, whatever it is doing, when no more can come."""
    with os.fdopen(os.dup(0), "rb") as stream:
        while True:
            try:
                calls.put(pickle.load(stream))
            except (EOFError, pickle.UnpicklingError):
                os._exit(0)


def _answer(function, arguments):
    try:
        return pickle.dumps((True, function(*arguments)))
    except Exception as problem:  # Whatever it is, it belongs to the caller.
        try:
            pickle.loads(pickle.dumps(problem))
        except Exception:  # Not every exception survives the way.
            problem = RuntimeError(f"{type(problem).__name__}: {problem}")
        return pickle.dumps((False, problem))
