"""What a file is that is no regular one."""

from __future__ import annotations

import stat

_KINDS = ((stat.S_ISDIR, "a folder"), (stat.S_ISFIFO, "a pipe"), (stat.S_ISSOCK, "a socket"))


def kind_of(mode: int) -> str | None:
    """Name the kind of a file by the mode that `os.stat` gives: "a pipe", say, or None for a regular file.

    Examples
    --------
    >>> import os
    >>> kind_of(os.stat(os.curdir).st_mode)
    'a folder'
    """
    if stat.S_ISREG(mode):
        return None
    return next((name for is_one, name in _KINDS if is_one(mode)), "a device")
