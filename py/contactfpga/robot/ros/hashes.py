"""The hash by which ROS 2 tells whether two programs mean the same type (REP 2011)."""

from __future__ import annotations

import functools
import hashlib
import json
from typing import Any

from contactfpga.robot.ros.types import Field, MessageType, message_type, needed

_NUMBERS = {
    "int8": 2,
    "uint8": 3,
    "int16": 4,
    "uint16": 5,
    "int32": 6,
    "uint32": 7,
    "int64": 8,
    "uint64": 9,
    "float32": 10,
    "float64": 11,
    "bool": 15,
    "byte": 16,
    "string": 17,
}
_NESTED, _FIXED_ARRAY, _ANY_ARRAY = 1, 48, 144
"""What is added to a type's number for an array of a fixed and of any length."""


@functools.cache
def type_hash(name: str) -> str:
    """``RIHS01_`` and 64 hexadecimal digits."""
    described = {
        "type_description": _described(message_type(name)),
        "referenced_type_descriptions": [_described(one) for one in needed(name)],
    }
    return "RIHS01_" + hashlib.sha256(json.dumps(described).encode()).hexdigest()


def _described(kind: MessageType) -> dict[str, Any]:
    return {"type_name": _full(kind.name), "fields": [_field(field) for field in kind.fields]}


def _field(field: Field) -> dict[str, Any]:
    number = _NESTED if field.nested else _NUMBERS[field.type]
    if field.count is not None:
        number += _FIXED_ARRAY if field.count else _ANY_ARRAY
    return {
        "name": field.name,
        "type": {
            "type_id": number,
            "capacity": field.count or 0,
            "string_capacity": 0,
            "nested_type_name": _full(field.type) if field.nested else "",
        },
    }


def _full(name: str) -> str:
    package, _, short = name.partition("/")
    return f"{package}/msg/{short}"
