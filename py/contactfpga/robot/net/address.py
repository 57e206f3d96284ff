"""Keys of boards, and which endpoints are this machine alone."""

from __future__ import annotations

import contextlib
import ipaddress
import os
import re
import stat
import sys
import tempfile
from pathlib import Path

from contactfpga.errors import ContactFPGAError

LOOPBACK = "tcp/127.0.0.1:7447"
"""An endpoint that every user of this machine reaches."""
_MOST_PATH = 100
"""Most bytes of a socket's path; operating systems take 103 or 107."""


def key_of(name: str, fingerprint: bytes) -> str:
    """The usual key of a board."""
    usual = re.sub(r"[^\w.@:+-]+", "-", name).strip("-") or fingerprint.hex()
    return f"contactfpga/{usual}"


def own_endpoint() -> str:
    """Where a publisher listens, and where a port looks for it, unless asked otherwise.

    It is a Unix socket in a folder that only this user can open: in ``XDG_RUNTIME_DIR`` if that is set, else in the
    folder for temporary files. On Windows it is :data:`LOOPBACK`. Raises :class:`~contactfpga.ContactFPGAError` where
    another user could open or replace the folder.
    """
    if sys.platform == "win32":
        return LOOPBACK
    runtime = os.environ.get("XDG_RUNTIME_DIR")
    folder = Path(runtime, "contactfpga") if runtime else Path(tempfile.gettempdir(), f"contactfpga-{os.getuid()}")
    path = folder.absolute() / "zenoh.sock"
    step = f"name an endpoint, for instance {LOOPBACK}, to publisher and readers"
    if (size := len(os.fsencode(path))) > _MOST_PATH or re.search(r"[?#;]", str(path)):
        limits = f"a socket's path has at most {_MOST_PATH} bytes, and no question mark, # or semicolon"
        raise ContactFPGAError(f"{path} has {size} bytes; {limits}; {step}")
    try:
        with contextlib.suppress(FileExistsError):
            folder.mkdir(0o700)
        found, above = folder.lstat(), folder.parent.stat()
    except OSError as error:
        raise ContactFPGAError(f"{folder} cannot be made for the socket: {error.strerror}; {step}") from None
    alone = stat.S_ISDIR(found.st_mode) and found.st_uid == os.getuid() and not found.st_mode & 0o077
    replaceable = above.st_uid not in (0, os.getuid()) or (above.st_mode & 0o022 and not above.st_mode & stat.S_ISVTX)
    if not alone or replaceable:
        raise ContactFPGAError(f"{folder} is not a folder that only you can open or replace; remove it, or {step}")
    return f"unixsock-stream/{path}"


def is_loopback(endpoint: str) -> bool:
    """Whether nobody on another machine can reach an endpoint such as ``tcp/127.0.0.1:7447``."""
    protocol, _, place = endpoint.partition("/")
    if protocol.startswith("unix"):
        return True
    host = re.sub(r":\d+$", "", re.split(r"[?#]", place)[0]).strip("[]")
    try:
        return host == "localhost" or ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False
