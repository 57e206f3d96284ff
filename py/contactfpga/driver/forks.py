"""What a child of ``fork`` inherits and must leave alone: ports, files and locks, which its parent goes on to use."""

from __future__ import annotations

import os
import weakref
from collections.abc import Callable
from typing import BinaryIO, Protocol

ELSEWHERE = "was opened in another process; open it anew in this one"
"""What whoever uses it in the child is told."""


class Owner(Protocol):
    """Has something that its parent goes on to use."""

    def forked(self) -> None:
        """This is the child, in which no other thread exists, though locks may be held by one. Waits for nothing."""


_owners: weakref.WeakSet[Owner] = weakref.WeakSet()
_functions: list[Callable[[], None]] = []


def watch(owner: Owner) -> None:
    """From now on tell this object in every child, as long as it lives."""
    _owners.add(owner)


def in_child(function: Callable[[], None]) -> Callable[[], None]:
    """Decorator: call this function of a module in every child, too, after all objects were told."""
    _functions.append(function)
    return function


def discard(file: BinaryIO) -> None:
    """Have a file in the child lead nowhere, so that nothing is written twice that waited to be written."""
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
