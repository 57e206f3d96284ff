"""The types of messages: read from their texts, which are the same files that a ROS workspace builds."""

from __future__ import annotations

import dataclasses
import functools
from importlib.resources import files
from pathlib import Path

from contactfpga.robot.ros.standard import STANDARD

PACKAGE = "contactfpga_msgs"
"""Of our own messages."""

PRIMITIVES = {
    "bool": "?",
    "byte": "B",
    "uint8": "B",
    "int8": "b",
    "uint16": "H",
    "int16": "h",
    "uint32": "I",
    "int32": "i",
    "uint64": "Q",
    "int64": "q",
    "float32": "f",
    "float64": "d",
}
"""Letters of :mod:`struct`; a string has none."""


def messages() -> Path:
    """Folder of our message texts, ``Zones.msg`` and the others."""
    package = Path(str(files("contactfpga"))).resolve()
    installed = package / "robot" / "ros" / "msg"
    return installed if installed.is_dir() else package.parents[1] / "ros2" / PACKAGE / "msg"  # in a source tree


@dataclasses.dataclass(frozen=True)
class Field:
    """A field of a message."""

    name: str
    type: str
    """A key of :data:`PRIMITIVES`, ``string``, or the name of a message: ``std_msgs/Header``."""
    count: int | None
    """Of an array with so many elements; 0: as many as there are; None: it is no array."""

    @property
    def nested(self) -> bool:
        """Whether it holds messages."""
        return "/" in self.type


@dataclasses.dataclass(frozen=True)
class MessageType:
    """A type of messages."""

    name: str
    """Package and type: ``contactfpga_msgs/Zones``."""
    fields: tuple[Field, ...]
    constants: tuple[tuple[str, int], ...]
    """Numbers that fields may have."""
    text: str

    def constant(self, name: str) -> int:
        """A number by its name in the text."""
        return dict(self.constants)[name]


@functools.cache
def message_type(name: str) -> MessageType:
    """A type by its name: ours, or one of the standard messages that we use. Raises KeyError for another one."""
    package, _, short = name.partition("/")
    if package != PACKAGE:
        return _parsed(name, STANDARD[name])
    path = messages() / f"{short}.msg"
    if not path.is_file():
        raise KeyError(name)
    return _parsed(name, path.read_text(encoding="utf-8"))


def needed(name: str) -> list[MessageType]:
    """The types that a type holds, and those they hold, each once, sorted by name; without itself."""
    found: dict[str, MessageType] = {}
    todo = [name]
    while todo:
        for field in message_type(todo.pop()).fields:
            if field.nested and field.type not in found:
                found[field.type] = message_type(field.type)
                todo.append(field.type)
    return [found[name] for name in sorted(found)]


def schema(name: str) -> str:
    """The text of a type with those of all that it holds, as recordings keep it (encoding ``ros2msg``)."""
    parts = [message_type(name).text]
    parts += [f"{'=' * 80}\nMSG: {one.name}\n{one.text}" for one in needed(name)]
    return "".join(part if part.endswith("\n") else part + "\n" for part in parts)


def _parsed(name: str, text: str) -> MessageType:
    fields, constants = [], []
    for line in text.splitlines():
        words = line.partition("#")[0].split()
        if not words:
            continue
        kind, rest = words[0], " ".join(words[1:])
        if "=" in rest:
            constant, _, value = rest.partition("=")
            constants.append((constant.strip(), int(value)))
        else:
            fields.append(_field(name.partition("/")[0], kind, rest))
    return MessageType(name, tuple(fields), tuple(constants), text)


def _field(package: str, kind: str, name: str) -> Field:
    kind, bracket, size = kind.partition("[")
    if kind not in PRIMITIVES and kind != "string" and "/" not in kind:
        kind = f"{package}/{kind}"
    return Field(name, kind, int(size.rstrip("]") or 0) if bracket else None)
