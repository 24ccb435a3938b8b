"""The lock of all access to netCDF and HDF5 in this process, that of xarray included.

Neither library is thread-safe, even on different files: without it, threads that read lazily crash.
"""

import sys
from threading import RLock


class Access:
    """A lock that a thread may take again. Who holds it keeps xarray from the libraries, too."""

    def __init__(self):
        self._lock, self._depth, self._others = RLock(), 0, []

    def acquire(self, blocking=True):
        """Take the lock; without blocking, say whether that could be done at once."""
        if not self._lock.acquire(blocking):
            return False
        try:
            taken = self._depth > 0 or self._take_others(blocking)
        except BaseException:
            self._give_back()
            raise
        if taken:
            self._depth += 1
        else:
            self._give_back()
        return taken

    def _take_others(self, blocking):
        for lock in _locks_of_xarray():
            if not lock.acquire(blocking):
                return False
            self._others.append(lock)
        return True

    def release(self):
        """Give the lock back, as often as it was taken."""
        self._depth -= 1
        if self._depth == 0:
            self._give_back()
        else:
            self._lock.release()

    def _give_back(self):
        while self._others:
            self._others.pop().release()
        self._lock.release()

    def __enter__(self):
        """Take the lock."""
        self.acquire()
        return self

    def __exit__(self, *_):
        """Give the lock back."""
        self.release()

    def __reduce__(self):
        """In every process that of the process: a dataset that was opened lazily can be sent."""
        return "ACCESS"


def _locks_of_xarray():
    """Those under which xarray reads the files of others, in the order in which it takes them."""
    backend = sys.modules.get("xarray.backends.netCDF4_")
    return backend.NETCDF4_PYTHON_LOCK.locks if backend else ()


ACCESS = Access()
