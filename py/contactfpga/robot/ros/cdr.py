"""Messages as ROS 2 sends and records them: CDR version 1, little-endian."""

from __future__ import annotations

import functools
import struct
from collections.abc import Callable, Mapping
from typing import Any

from contactfpga.robot.ros.types import PRIMITIVES, MessageField, message_type

HEAD = b"\x00\x01\x00\x00"
"""Header of plain CDR, lowest byte first."""

Message = Mapping[str, Any]
"""Fields by name; a nested message is a mapping, an array any sequence."""
_Put = Callable[[bytearray, Message], None]
_Path = tuple[str, ...]


def encode(name: str, message: Message) -> bytes:
    """A message of this type (``contactfpga_msgs/Zones``), with its encapsulation header."""
    out = bytearray()
    for put in _puts(name):
        put(out, message)
    return HEAD + bytes(out)


@functools.cache
def _puts(name: str) -> tuple[_Put, ...]:
    """Writers of the fields in turn; consecutive numbers are written at once."""
    puts: list[_Put] = []
    letters, paths = "", []  # of the numbers that wait to be written
    for path, field in [*_leaves(name, ()), ((), None)]:
        if field is not None and field.count is None and field.type != "string":
            letters += PRIMITIVES[field.type]
            paths.append(path)
            continue
        if paths:
            puts.append(functools.partial(_put_numbers, letters, tuple(paths)))
            letters, paths = "", []
        if field is not None:
            puts.append(functools.partial(_put_field, path, field))
    return tuple(puts)


def _leaves(name: str, path: _Path) -> list[tuple[_Path, MessageField | None]]:
    found: list[tuple[_Path, MessageField | None]] = []
    for field in message_type(name).fields:
        where = (*path, field.name)
        found += _leaves(field.type, where) if field.nested and field.count is None else [(where, field)]
    return found


def _at(message: Message, path: _Path) -> Any:
    for name in path:
        message = message[name]
    return message


def _put_numbers(letters: str, paths: tuple[_Path, ...], out: bytearray, message: Message) -> None:
    out += _aligned(letters, len(out) % 8).pack(*[_at(message, path) for path in paths])


@functools.cache
def _aligned(letters: str, offset: int) -> struct.Struct:
    form = "<"
    for letter in letters:
        size = struct.calcsize("<" + letter)
        form += "x" * (-offset % size) + letter
        offset += -offset % size + size
    return struct.Struct(form)


def _put_field(path: _Path, field: MessageField, out: bytearray, message: Message) -> None:
    value = _at(message, path)
    if field.count is None:
        _put_string(out, value)
    else:
        _put_array(out, field, value)


def _put_string(out: bytearray, text: str) -> None:
    data = text.encode() + b"\0"
    _put_count(out, len(data))
    out += data


def _put_count(out: bytearray, count: int) -> None:
    out += _aligned("I", len(out) % 4).pack(count)


def _put_array(out: bytearray, field: MessageField, values: Any) -> None:
    if not field.count:
        _put_count(out, len(values))
    elif len(values) != field.count:
        raise ValueError(f"{field.name} has {len(values)} elements; it must have {field.count}")
    if field.nested:
        puts = _puts(field.type)
        for value in values:
            for put in puts:
                put(out, value)
    elif field.type == "string":
        for value in values:
            _put_string(out, value)
    elif isinstance(values, bytes):
        out += values
    elif values:
        letter = PRIMITIVES[field.type]
        out += b"\0" * (-len(out) % struct.calcsize("<" + letter))
        out += struct.pack(f"<{len(values)}{letter}", *values)
