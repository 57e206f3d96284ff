"""Bugs planted in the gateware to see that a proof finds them; the gateware knows nothing of them."""

import contextlib
import dataclasses
import inspect
import textwrap
from collections.abc import Iterator
from unittest import mock


@dataclasses.dataclass(frozen=True)
class Bug:
    """A method with a few words of its source exchanged."""

    name: str
    owner: type
    method: str
    old: str
    """Must occur exactly once in the method."""
    new: str


@contextlib.contextmanager
def planted(bug: Bug) -> Iterator[None]:
    """While this lasts, the bug's class has the changed method.

    Raises ValueError when the text to exchange does not occur exactly once.
    """
    method = getattr(bug.owner, bug.method)
    source = textwrap.dedent(inspect.getsource(method))
    if (count := source.count(bug.old)) != 1:
        raise ValueError(f"{bug.name}: {bug.old!r} occurs {count} times in {method.__qualname__}, not once")
    names: dict = {}
    exec(compile(source.replace(bug.old, bug.new), f"<{bug.name}>", "exec"), method.__globals__, names)
    with mock.patch.object(bug.owner, bug.method, names[bug.method]):
        yield
