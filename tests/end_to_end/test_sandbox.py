"""Calls in another process: whatever it does, they end, and it does not outlive the one that asks."""

import ctypes
import os
import pickle
import resource
import signal
import subprocess
import sys
import threading
import time
from contextlib import suppress

import psutil
import pytest

from studies import sandbox
from studies.sandbox import Lost, NoHelper, call, own_helper

THIRD = 300_000_000


class Boom:
    """Cannot be read where it arrives."""

    def __init__(self, problem):
        self.problem = problem

    def __reduce__(self):
        return fail, (self.problem,)


def fail(problem):
    raise problem


def pause(seconds):
    time.sleep(seconds)


class Sleeper:
    """Takes long to be read."""

    def __reduce__(self):
        return pause, (60,)


def stop():
    os.kill(os.getpid(), signal.SIGSTOP)


def hold_everything():
    """Sleep in C without giving up the lock of Python."""
    ctypes.PyDLL(None).sleep(60)


def fill(size):
    return len(bytearray(size))


def spin(seconds):
    """Work for so long by the processor's clock."""
    end = time.process_time() + seconds
    while time.process_time() < end:
        pass
    return "done"


def say():
    """Print what must not be taken for an answer."""
    for descriptor in (1, 2):
        with suppress(OSError):
            os.write(descriptor, b"no answer" * 100)
    return "said"


def gone(pid):
    try:
        return psutil.Process(pid).status() == psutil.STATUS_ZOMBIE
    except psutil.Error:
        return True


def wait_until(condition):
    while not condition():
        time.sleep(0.02)


def test_a_call_that_loses_its_process_says_how_and_the_next_one_is_served():
    assert call(len, "four", limit=60) == 4
    with pytest.raises(Lost, match="status 5"):
        call(os._exit, 5, limit=60)
    with pytest.raises(Lost, match=r"no answer within 0\.5 s"):
        call(time.sleep, 30, limit=0.5)
    with pytest.raises(ZeroDivisionError):
        call(divmod, 1, 0, limit=60)
    assert call(len, "seven", limit=60) == 5


@pytest.mark.parametrize("problem", [ImportError("tea"), MemoryError(), SyntaxError("x"), EOFError()])
def test_what_cannot_be_read_there_is_one_sentence(problem):
    with pytest.raises(NoHelper, match=type(problem).__name__):
        call(len, Boom(problem), limit=2)
    assert call(len, "four", limit=60) == 4


def test_what_cannot_be_sent_leaves_the_helper_as_it_was():
    assert call(len, "four", limit=60) == 4
    process = own_helper().process
    with pytest.raises((pickle.PicklingError, AttributeError, TypeError)):
        call(len, threading.Lock(), limit=60)
    assert call(len, "seven", limit=60) == 5
    assert own_helper().process is process


def test_a_helper_that_does_not_take_up_its_work_in_time_is_one_sentence(monkeypatch):
    assert call(len, "four", limit=60) == 4
    monkeypatch.setattr(sandbox, "STARTING", 0.2)
    monkeypatch.setattr(sandbox, "STARTS", 1)
    with pytest.raises(NoHelper, match=r"it does nothing for 0\.2 s"):
        call(len, Sleeper(), limit=60)


@pytest.mark.parametrize("hang", [stop, hold_everything])
def test_a_helper_that_is_stopped_or_holds_everything_is_late(hang):
    with pytest.raises(Lost, match=r"no answer within 0\.5 s"):
        call(hang, limit=0.5)


def test_a_helper_that_was_stopped_or_killed_between_calls_is_replaced(monkeypatch):
    assert call(len, "four", limit=60) == 4
    own_helper().process.kill()
    assert call(len, "four", limit=60) == 4
    stopped = own_helper().process
    stopped.send_signal(signal.SIGSTOP)
    wait_until(lambda: psutil.Process(stopped.pid).status() == psutil.STATUS_STOPPED)
    original = sandbox.Helper._start

    def start(helper):
        original(helper)
        monkeypatch.setattr(sandbox, "STARTING", 0.2 if helper.process is stopped else 60.0)

    monkeypatch.setattr(sandbox.Helper, "_start", start)
    assert call(len, "four", limit=60) == 4
    assert own_helper().process is not stopped


def test_time_in_which_it_waits_for_a_processor_does_not_count():
    """Two that work share one processor; neither is late, though both take twice their time."""
    busy = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(2)]
    one = {min(os.sched_getaffinity(0))}
    try:
        assert call(len, "four", limit=60) == 4
        for pid in (own_helper().process.pid, *(process.pid for process in busy)):
            os.sched_setaffinity(pid, one)
        assert call(spin, 0.2, limit=0.3) == "done"
        with pytest.raises(Lost, match=r"no answer within 0\.3 s"):
            call(spin, 1e9, limit=0.3)
    finally:
        for process in busy:
            process.kill()
            process.wait()


def test_a_call_may_be_given_so_much_memory():
    with pytest.raises(MemoryError):
        call(fill, 2 * THIRD, limit=60, memory=THIRD)
    assert call(fill, THIRD // 2, limit=60, memory=THIRD) == THIRD // 2
    assert call(fill, 2 * THIRD, limit=60) == 2 * THIRD
    assert call(resource.getrlimit, resource.RLIMIT_AS, limit=60) == resource.getrlimit(resource.RLIMIT_AS)


def test_helpers_end_with_the_threads_that_they_serve():
    pids = []
    threads = [threading.Thread(target=lambda: pids.append(call(os.getpid, limit=60))) for _ in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(set(pids)) == 3
    wait_until(lambda: all(map(gone, pids)))


def test_closing_a_helper_ends_the_call_that_another_thread_makes():
    ready, told = threading.Event(), []

    def work():
        assert call(len, "four", limit=60) == 4
        told.append(own_helper())
        ready.set()
        for _ in range(2):
            try:
                call(time.sleep, 60, limit=60)
            except NoHelper as problem:
                told.append(str(problem))

    thread = threading.Thread(target=work)
    thread.start()
    ready.wait()
    told[0].close()
    thread.join()
    assert told[1:] == [sandbox.STOPPED] * 2


ORPHAN = """
import os, signal, sys, threading
from end_to_end import test_sandbox
from studies.sandbox import call, own_helper
assert call(len, "four", limit=60) == 4
print(own_helper().process.pid, flush=True)
call(getattr(test_sandbox, sys.argv[1]), *map(float, sys.argv[2:]), limit=600)
"""


@pytest.mark.parametrize("work", [("pause", "600"), ("stop",), ("hold_everything",), ("spin", "1e9")])
def test_no_helper_outlives_the_process_that_asks(work):
    asks = subprocess.Popen(
        [sys.executable, "-c", ORPHAN, *work],
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
    )
    pid = int(asks.stdout.readline())
    if work == ("stop",):
        wait_until(lambda: psutil.Process(pid).status() == psutil.STATUS_STOPPED)
    asks.kill()
    asks.wait()
    asks.stdout.close()
    wait_until(lambda: gone(pid))


def test_a_fork_has_a_helper_of_its_own():
    assert call(len, "four", limit=60) == 4
    process = own_helper().process
    child = os.fork()
    if child == 0:
        # Nothing of pytest must run here.
        good = False
        try:
            good = call(len, "seven", limit=60) == 5 and own_helper().process.pid != process.pid
            sandbox.OWN.__dict__.clear()
        finally:
            os._exit(0 if good else 1)
    assert os.waitpid(child, 0)[1] == 0
    assert call(len, "four", limit=60) == 4
    assert own_helper().process is process


def talkative(folder, text):
    (folder / "sitecustomize.py").write_text(text)
    return os.environ | {"PYTHONPATH": os.pathsep.join([str(folder), *sys.path])}


CALL = "from studies.sandbox import call; print('answer', call(len, 'four', limit=60))"


def test_start_up_code_that_prints_is_no_answer(tmp_path):
    environment = talkative(tmp_path, "print('good morning')\nimport sys\nprint('!', file=sys.stderr)")
    told = subprocess.run([sys.executable, "-c", CALL], env=environment, capture_output=True, text=True)
    assert told.stdout == "good morning\nanswer 4\n", told.stderr
    assert told.stderr == "!\n"


def test_a_helper_that_cannot_start_is_one_sentence_with_its_last_words(tmp_path):
    text = "import sys\nif any('sandbox' in word for word in sys.orig_argv): sys.exit('no tea')"
    program = tmp_path / "program.py"
    program.write_text(CALL)
    told = subprocess.run(
        [sys.executable, str(program)], env=talkative(tmp_path, text), capture_output=True, text=True
    )
    last = told.stderr.splitlines()[-1]
    assert (
        "no helper process can take up its work (the process ended with status 1: SystemExit: no tea)" in last
    )


@pytest.mark.parametrize("closed", ["2>&-", "<&- >&- 2>&-", "2>/dev/full"])
def test_closed_descriptors_are_no_hindrance(closed, tmp_path):
    program = tmp_path / "program.py"
    program.write_text(
        "from end_to_end.test_sandbox import say\nfrom studies.sandbox import call\n"
        "with open('done', 'w') as done:\n    done.write(call(say, limit=60))"
    )
    script = f'"{sys.executable}" program.py {closed}'
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    subprocess.run(["sh", "-c", script], cwd=tmp_path, env=environment, check=True)
    assert (tmp_path / "done").read_text() == "said"
