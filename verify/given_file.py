"""Reading a file that was given to be verified: a regular one of bounded size, so that reading ends."""

from __future__ import annotations

import errno
import os
import stat
from pathlib import Path


def read_given(path: Path, max_bytes: int, *, links: bool = True) -> bytes:
    """Return the bytes of a file.

    Parameters
    ----------
    path : Path
        The file.
    max_bytes : int
        Most bytes of it.
    links : bool
        Whether the file itself may be a symbolic link, which can lead anywhere.

    Raises
    ------
    OSError
        If it cannot be read, is no regular file, or is longer; its `strerror` says why.
    """
    # Without this flag, a pipe is opened once somebody writes into it, and not before.
    flags = os.O_RDONLY | os.O_CLOEXEC | os.O_NONBLOCK
    try:
        number = os.open(path, flags if links else flags | os.O_NOFOLLOW)
    except OSError as error:
        if links or error.errno != errno.ELOOP:
            raise
        raise OSError(errno.ELOOP, "it is a symbolic link", str(path)) from None
    try:
        if not stat.S_ISREG(os.fstat(number).st_mode):
            raise OSError(errno.EINVAL, "it is no regular file", str(path))
        with os.fdopen(number, "rb", closefd=False) as file:
            content = file.read(max_bytes + 1)
    finally:
        os.close(number)
    if len(content) > max_bytes:
        raise OSError(errno.EFBIG, f"it has more than {max_bytes} bytes", str(path))
    return content
