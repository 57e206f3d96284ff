"""Messages of ROS 2 as bytes: CDR, lowest byte first, from values in the order of a type's fields."""

from __future__ import annotations

import functools
import struct
from collections.abc import Callable, Sequence
from typing import Any

from contactfpga.ros.types import PRIMITIVES, Field, message_type

BEGIN = b"\x00\x01\x00\x00"
"""Before every message; places are counted from its end."""

Put = Callable[[bytearray, Any], None]


def encode(name: str, values: Sequence[Any]) -> bytes:
    """A message of a type such as ``contactfpga_msgs/Zones``; a message in it is a sequence of its values likewise."""
    out = bytearray()
    _message(name)(out, values)
    return BEGIN + bytes(out)


def aligned(offset: int, size: int) -> int:
    """The first place from ``offset`` on at which a value of ``size`` bytes may begin."""
    return -(-offset // size) * size


@functools.cache
def _message(name: str) -> Put:
    fields = [_field(field) for field in message_type(name).fields]

    def put(out: bytearray, values: Sequence[Any]) -> None:
        for one, value in zip(fields, values, strict=True):
            one(out, value)

    return put


def _field(field: Field) -> Put:
    if field.nested:
        one = _message(field.type)
    elif field.type == "string":
        one = _put_string
    else:
        one = _number(PRIMITIVES[field.type])
    if field.count is None:
        return one
    if PRIMITIVES.get(field.type) == "B":
        return _put_bytes if field.count == 0 else _extend
    return _array(one, field.count)


def _array(one: Put, count: int) -> Put:
    size = _number("I")

    def put(out: bytearray, values: Sequence[Any]) -> None:
        if not count:
            size(out, len(values))
        for value in values:
            one(out, value)

    return put


@functools.cache
def _number(letter: str) -> Put:
    packed = struct.Struct(f"<{letter}")

    def put(out: bytearray, value: float) -> None:
        out += bytes(-len(out) % packed.size)
        out += packed.pack(value)

    return put


def _put_string(out: bytearray, value: str) -> None:
    data = value.encode() + b"\0"
    _number("I")(out, len(data))
    out += data


def _put_bytes(out: bytearray, value: bytes) -> None:
    _number("I")(out, len(value))
    out += value


def _extend(out: bytearray, value: bytes) -> None:
    out += value
