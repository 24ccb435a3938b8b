"""Linear algebra whose last bits do not depend on the number of its threads.

BLAS and LAPACK add up in another order with another number of threads; even a long scalar product is divided
among them. The matrices here are small, and processors are better used by processes: whatever calls these
libraries does so on one thread.
"""

from functools import cache, wraps
from threading import RLock

from threadpoolctl import ThreadpoolController

ALONE = RLock()
"""The number of threads is one for the whole process: who is done first must not set it for who is not."""


def single_threaded(function):
    """Let a function, and all it calls, use one thread of BLAS; threads of Python take turns in it."""

    @wraps(function)
    def alone(*arguments, **options):
        with ALONE, _libraries().limit(limits=1):
            return function(*arguments, **options)

    return alone


@cache
def _libraries():
    import scipy.linalg  # noqa: F401  (only what is loaded can be limited)

    return ThreadpoolController()
