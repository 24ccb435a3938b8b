"""Calls in a process of their own, which may crash or never return: that costs the call, not the run.

Each thread keeps one such helper and starts another when it is lost. A helper ends with the thread that it
serves, and with its process, however that ends. Time is kept here, whatever the helper does: no wait is
without a limit. Answers travel by a descriptor of their own: what start-up code or a library prints is none.

Not here: what is done about a call that is lost.
"""

import os
import pickle
import queue
import resource
import signal
import socket
import struct
import subprocess
import sys
import threading
import time
import weakref
from contextlib import contextmanager, suppress
from tempfile import TemporaryFile
from typing import Any

from studies.errors import StudyError

SERVE = "from studies.sandbox import serve; serve({}, {}, {})"
MALLOC = {"MALLOC_TRIM_THRESHOLD_": str(1 << 28), "MALLOC_MMAP_THRESHOLD_": str(1 << 28)}
"""Freed memory returned at the default of 128 kB costs a third of the time in page faults."""
STARTING = 60.0
"""Seconds within which a helper takes up a call; before the first, Python starts and imports."""
STARTS = 3
"""How many helpers may be lost before they take up a call; then it is not by chance."""
LOOK_AGAIN = 1.0
"""Seconds between looks at a helper that is late because it waits for a processor."""
AT_ONCE = 1e-3
ENDING = 5.0
"""Seconds to wait for a process that was killed; one that waits for a disk is left behind."""
STOPPED = "the run was stopped"
LENGTH = struct.Struct("!Q")
PR_SET_PDEATHSIG = 1
OWN = threading.local()


class Lost(Exception):
    """The process did not survive a call; the message says how it ended."""


class NoHelper(StudyError):
    """There is no process to make calls in, so that nothing is known of the call."""


def call(function, *arguments, limit, memory=None):
    """Call a function in another process.

    Parameters
    ----------
    function : callable
        Of a module, as are the types of its arguments and of its result.
    *arguments
    limit : float
        Seconds after which the call is given up. Those in which it waits for a processor do not count.
    memory : int, optional
        Bytes that the call may take; where it asks for more, it meets a MemoryError.

    Returns
    -------
    object
        What the function returns. What it raises is raised.

    Raises
    ------
    Lost
        If the process crashed, was killed, or did not answer in time.
    NoHelper
        If none can be started, or none can read what it is to do.
    """
    return own_helper().call(function, arguments, limit, memory)


def own_helper():
    """The helper of this thread."""
    helper = getattr(OWN, "helper", None)
    # That of a process which forked is its own: two would take each other's answers.
    if helper is None or helper.parent != os.getpid():
        helper = OWN.helper = Helper()
    return helper


def open_standard_descriptors():
    """Open those that are closed to nowhere: the next file opened would get all that is printed."""
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)


open_standard_descriptors()


class Helper:
    """A process that makes calls for one thread, started when it is needed."""

    def __init__(self):
        self.parent = os.getpid()
        # None until a process is started.
        self.process: Any = None
        self.channel: Any = None
        self.said: Any = None
        self.closed, self.changing = False, threading.Lock()

    def call(self, function, arguments, limit, memory=None):
        """Call a function there; see the function of this name."""
        spent = self._hand_over(pickle.dumps((function, arguments, memory)))
        try:
            answer = self._receive(limit, spent)
        except TimeoutError:
            self._end()
            raise Lost(f"no answer within {limit:g} s") from None
        except (EOFError, OSError):
            status = self._end()
            if self.closed:
                raise NoHelper(STOPPED) from None
            raise Lost(_cause_of_death(status)) from None
        except BaseException:
            # Its answer would be taken for that of the next call.
            self._end()
            raise
        good, value = pickle.loads(answer)
        if good:
            return value
        raise value

    def close(self):
        """End the process for good; a call that another thread makes there ends at once."""
        with self.changing:
            self.closed = True
            if self.process is not None:
                self.process.kill()

    def _hand_over(self, message):
        """Let a process take up a call: the processor seconds that it has spent before."""
        for _ in range(STARTS):
            try:
                self._start()
                self.channel.settimeout(STARTING)
                self.channel.sendall(LENGTH.pack(len(message)) + message)
                taken, told = pickle.loads(self._receive(STARTING, 0.0))
            except TimeoutError:
                self._end()
                told = f"it does nothing for {STARTING:g} s"
            except (EOFError, ConnectionError):
                words = self._last_words()
                told = _cause_of_death(self._end()) + words
            except OSError as problem:
                self._end()
                told = problem.strerror or problem
            except BaseException:
                self._end()
                raise
            else:
                if taken:
                    return told
                break
        raise NoHelper(
            f"no helper process can take up its work ({told}); see that it gets memory, processes and open "
            "files (`ulimit -a`) and that Python can import this package there"
        )

    def _start(self):
        """Start a process unless there is one."""
        with self.changing:
            if self.closed:
                raise NoHelper(STOPPED)
            if self.process is not None and self.process.poll() is None:
                return
        self._end()
        open_standard_descriptors()
        here, there = socket.socketpair()
        stderr = os.dup(2)
        try:
            self.said = TemporaryFile()  # noqa: SIM115 (read when it does not start)
            path = os.pathsep.join(entry for entry in sys.path if entry)
            process = subprocess.Popen(
                [sys.executable, "-P", "-c", SERVE.format(there.fileno(), stderr, self.parent)],
                stdin=subprocess.DEVNULL,
                stdout=self.said,
                stderr=self.said,
                pass_fds=(there.fileno(), stderr),
                env={**MALLOC, **os.environ, "PYTHONPATH": path},
                # Ctrl-C reaches every process of the terminal's group.
                process_group=0,
            )
        except BaseException:
            here.close()
            raise
        finally:
            there.close()
            os.close(stderr)
        with self.changing:
            self.process, self.channel = process, here
            self.ending = weakref.finalize(self, _end, self.parent, process, here, self.said)
            if self.closed:
                process.kill()

    def _receive(self, limit, spent):
        """A message, within so many seconds in which the process works or sleeps."""
        deadline = time.monotonic() + limit
        (length,) = LENGTH.unpack(self._read(LENGTH.size, limit, spent, deadline))
        return self._read(length, limit, spent, deadline)

    def _read(self, size, limit, spent, deadline):
        content, late = bytearray(), False
        while len(content) < size:
            self.channel.settimeout(max(deadline - time.monotonic(), AT_ONCE))
            try:
                part = self.channel.recv(min(size - len(content), 1 << 20))
            except TimeoutError:
                if late:
                    raise
                # One that sleeps may have answered just now, so it is asked once more.
                late = not self._waits_for_processor(limit + spent)
                deadline = time.monotonic() + (0 if late else min(LOOK_AGAIN, limit))
                continue
            if not part:
                raise EOFError
            content += part
        return content

    def _waits_for_processor(self, most):
        """Whether the process would go on if it were let, and has not had so many seconds of processor."""
        import psutil

        try:
            process = psutil.Process(self.process.pid)
            times = process.cpu_times()
            return process.status() == psutil.STATUS_RUNNING and times.user + times.system < most
        except psutil.Error:
            return False

    def _last_words(self):
        """What a process said that did not even start."""
        self.said.seek(0)
        lines = self.said.read().decode(errors="replace").split("\n")
        return "".join(f": {line.strip()}" for line in [line for line in lines if line.strip()][-1:])

    def _end(self):
        """End the process: its exit status, None if it does not end."""
        if self.process is None:
            return None
        process = self.process
        with self.changing:
            self.process = None
        self.ending()
        return process.returncode


def _end(parent, process, *files):
    for file in files:
        file.close()
    if os.getpid() != parent:
        return
    process.kill()
    with suppress(subprocess.TimeoutExpired):
        process.wait(ENDING)


def _cause_of_death(status):
    if status is None:
        return "the process hangs and cannot be killed"
    if status == -signal.SIGKILL:
        return "the process was killed (SIGKILL), perhaps for want of memory"
    if status < 0:
        return f"the process crashed ({signal.Signals(-status).name})"
    return f"the process ended with status {status}"


def serve(descriptor, stderr, parent):
    """Answer calls until the process that asks is gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    os.set_inheritable(descriptor, False)
    _die_with(parent)
    channel = socket.socket(fileno=descriptor)
    calls: queue.SimpleQueue[Any] = queue.SimpleQueue()
    threading.Thread(target=_listen, args=(channel, calls), daemon=True).start()

    def answer(message):
        try:
            channel.sendall(LENGTH.pack(len(message)) + message)
        except OSError:
            os._exit(0)

    while True:
        try:
            function, arguments, memory = pickle.loads(calls.get())
        except Exception as problem:  # It may be anything that an import raises.
            told = f"{type(problem).__name__}: {problem}".removesuffix(": ")
            answer(pickle.dumps((False, told)))
            continue
        # What is printed from here on is for the user, and no answer.
        os.dup2(stderr, 1)
        os.dup2(stderr, 2)
        answer(pickle.dumps((True, time.process_time())))
        with _within(memory):
            value = _answer(function, arguments)
        answer(value)


def _die_with(parent):
    """End with the thread that started this process, also while it is stopped, where the system can do so."""
    if sys.platform == "linux":
        import ctypes

        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:
        os._exit(0)


def _listen(channel, calls):
    """Pass calls on; end the process, whatever it is doing, when no more can come."""
    with suppress(OSError), channel.makefile("rb") as stream:
        while head := stream.read(LENGTH.size):
            calls.put(stream.read(*LENGTH.unpack(head)))
    os._exit(0)


@contextmanager
def _within(memory):
    """Let this process take no more than so many bytes beyond what it has."""
    if memory is None:
        yield
        return
    import psutil

    before = resource.getrlimit(resource.RLIMIT_AS)
    most = psutil.Process().memory_info().vms + memory
    most = min([most, *(limit for limit in before if limit != resource.RLIM_INFINITY)])
    resource.setrlimit(resource.RLIMIT_AS, (most, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, before)


def _answer(function, arguments):
    try:
        return pickle.dumps((True, function(*arguments)))
    except Exception as problem:  # Whatever it is, it belongs to the caller.
        try:
            pickle.loads(pickle.dumps(problem))
        except Exception:  # Not every exception survives the way.
            problem = RuntimeError(f"{type(problem).__name__}: {problem}")
        return pickle.dumps((False, problem))
