"""Protects the parent's ports, files and locks, which a child of ``fork`` inherits."""

from __future__ import annotations

import os
import weakref
from collections.abc import Callable
from typing import BinaryIO, Protocol

ELSEWHERE = "was opened in another process; open it anew in this one"
"""End of the error message in the child."""


class Owner(Protocol):
    """An object with resources that the parent continues to use."""

    def forked(self) -> None:
        """Called in the child, the only thread there, while locks may be held; must not block."""


_owners: weakref.WeakSet[Owner] = weakref.WeakSet()
_functions: list[Callable[[], None]] = []


def watch(owner: Owner) -> None:
    _owners.add(owner)


def in_child(function: Callable[[], None]) -> Callable[[], None]:
    """Decorator: call this module's function in every child, too, after all objects."""
    _functions.append(function)
    return function


def discard(file: BinaryIO) -> None:
    """Redirect the child's file to nowhere, so that buffered bytes are not written twice."""
    nowhere = os.open(os.devnull, os.O_RDWR)
    os.dup2(nowhere, file.fileno(), inheritable=False)
    os.close(nowhere)


def _tell() -> None:
    for owner in list(_owners):
        owner.forked()
    for function in _functions:
        function()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_tell)
