"""Keeps sockets of a library on this computer. Cyclone DDS sends on the interface that it is given, but takes packets
from all of them; Linux can hold back those that come from outside."""

from __future__ import annotations

import contextlib
import os
import socket
import sys
from collections.abc import Callable
from typing import TypeVar

_Made = TypeVar("_Made")

DEVICE = b"lo"
_FOLDER = "/proc/self/fd"


def kept_inside(make: Callable[[], _Made]) -> _Made:
    """What ``make`` returns; the sockets that it opened take packets from this computer alone. On Linux since 5.7;
    elsewhere it changes nothing."""
    if not sys.platform.startswith("linux"):
        return make()
    before = set(_sockets())
    made = make()
    for name, number in _sockets().items():
        if name not in before:
            _keep_inside(number)
    return made


def _sockets() -> dict[str, int]:
    """The process's sockets: their names, and a number of each."""
    found = {}
    for number in os.listdir(_FOLDER):
        with contextlib.suppress(OSError):  # closed meanwhile
            name = os.readlink(f"{_FOLDER}/{number}")
            if name.startswith("socket:"):
                found[name] = int(number)
    return found


def _keep_inside(number: int) -> None:
    with contextlib.suppress(OSError), socket.socket(fileno=os.dup(number)) as found:  # not by an older Linux
        if found.family == socket.AF_INET and found.type == socket.SOCK_DGRAM:
            found.setsockopt(socket.SOL_SOCKET, socket.SO_BINDTODEVICE, DEVICE)
