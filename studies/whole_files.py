"""Files that are written whole and then renamed into place: a reader never sees a part of one.

Not here: what is in them.
"""

import errno
import os
import re
import secrets
from contextlib import contextmanager, suppress
from pathlib import Path

PART = ".part"
NO_SYNC = {errno.EINVAL, errno.EBADF, errno.ENOSYS, errno.ENOTSUP, errno.EOPNOTSUPP}
"""What file systems answer that cannot tell when something is on the disk."""


@contextmanager
def written_whole(path, replaces=True):
    """Give a temporary name beside `path`; on success the file is synced and renamed to `path`.

    A reader never sees a part of a file, and a good file is replaced only by a complete one, or, unless this
    one `replaces` it, not at all.

    Raises
    ------
    FileExistsError
        If there is a file that is not to be replaced.
    """
    path = Path(os.path.realpath(path))
    with temporary_beside(path) as temporary:
        yield temporary
        sync(temporary)
        if replaces:
            os.replace(temporary, path)
        else:
            _give_name(temporary, path)
        sync(path.parent)


def _give_name(temporary, path):
    """Rename a file unless the name is taken."""
    try:
        os.link(temporary, path)
    except FileExistsError:
        raise
    except OSError:
        # A file system where a file has but one name.
        if os.path.lexists(path):
            raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST), str(path)) from None
        os.replace(temporary, path)


@contextmanager
def temporary_beside(path):
    """Give an empty file beside `path`, with a name of its own, that is gone in the end."""
    temporary = temporary_name(path)
    # With the permissions of any new file here: from them the system takes those that the umask denies.
    os.close(os.open(temporary, os.O_RDWR | os.O_CREAT | os.O_EXCL, 0o666))
    try:
        yield temporary
    finally:
        with suppress(FileNotFoundError):
            os.unlink(temporary)


def temporary_name(path):
    """A name beside `path` for what becomes it."""
    return path.with_name(f".{path.name}.{secrets.token_hex(4)}{PART}")


def discard_temporaries(path):
    """Remove what writers of `path` left when they were killed; nobody else may be writing it now."""
    path = Path(os.path.realpath(path))
    name = re.compile(rf"\.{re.escape(path.name)}\.[0-9a-z_]{{8}}{re.escape(PART)}")
    for leftover in path.parent.iterdir():
        if name.fullmatch(leftover.name):
            with suppress(OSError):
                leftover.unlink()


def sync(path):
    """Wait until a file, or the names in a folder, are on the disk, where the file system can tell."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    except OSError as problem:
        if problem.errno not in NO_SYNC:
            raise
    finally:
        os.close(descriptor)
