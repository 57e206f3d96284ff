"""Message types, read from the texts that a ROS workspace builds; and their hash in ROS 2 (REP 2011)."""

from __future__ import annotations

import dataclasses
import functools
import hashlib
import json
from importlib.resources import files
from pathlib import Path
from typing import Any

PACKAGE = "contactfpga_msgs"
"""Package of our own messages."""

STANDARD = {
    "builtin_interfaces/Time": "int32 sec\nuint32 nanosec\n",
    "builtin_interfaces/Duration": "int32 sec\nuint32 nanosec\n",
    "std_msgs/Header": "builtin_interfaces/Time stamp\nstring frame_id\n",
    "std_msgs/ColorRGBA": "float32 r\nfloat32 g\nfloat32 b\nfloat32 a\n",
    "geometry_msgs/Point": "float64 x\nfloat64 y\nfloat64 z\n",
    "geometry_msgs/Vector3": "float64 x\nfloat64 y\nfloat64 z\n",
    "geometry_msgs/Quaternion": "float64 x\nfloat64 y\nfloat64 z\nfloat64 w\n",
    "geometry_msgs/Pose": "Point position\nQuaternion orientation\n",
    "geometry_msgs/Transform": "Vector3 translation\nQuaternion rotation\n",
    "geometry_msgs/TransformStamped": "std_msgs/Header header\nstring child_frame_id\nTransform transform\n",
    "geometry_msgs/Wrench": "Vector3 force\nVector3 torque\n",
    "geometry_msgs/WrenchStamped": "std_msgs/Header header\nWrench wrench\n",
    "tf2_msgs/TFMessage": "geometry_msgs/TransformStamped[] transforms\n",
    "diagnostic_msgs/KeyValue": "string key\nstring value\n",
    "diagnostic_msgs/DiagnosticStatus": """byte level
string name
string message
string hardware_id
KeyValue[] values
""",
    "diagnostic_msgs/DiagnosticArray": "std_msgs/Header header\nDiagnosticStatus[] status\n",
    "sensor_msgs/CompressedImage": "std_msgs/Header header\nstring format\nuint8[] data\n",
    "visualization_msgs/UVCoordinate": "float32 u\nfloat32 v\n",
    "visualization_msgs/MeshFile": "string filename\nuint8[] data\n",
    "visualization_msgs/Marker": """std_msgs/Header header
string ns
int32 id
int32 type
int32 action
geometry_msgs/Pose pose
geometry_msgs/Vector3 scale
std_msgs/ColorRGBA color
builtin_interfaces/Duration lifetime
bool frame_locked
geometry_msgs/Point[] points
std_msgs/ColorRGBA[] colors
string texture_resource
sensor_msgs/CompressedImage texture
UVCoordinate[] uv_coordinates
string text
string mesh_resource
MeshFile mesh_file
bool mesh_use_embedded_materials
""",
    "visualization_msgs/MarkerArray": "Marker[] markers\n",
}
"""Standard messages of ROS 2 in use, with fields in order, as in Jazzy and Kilted."""

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
    """Folder of our message texts, such as ``Zones.msg``."""
    package = Path(str(files("contactfpga"))).resolve()
    installed = package / "robot" / "ros" / "msg"
    return installed if installed.is_dir() else package.parents[1] / "ros2" / PACKAGE / "msg"  # in a source tree


@dataclasses.dataclass(frozen=True)
class MessageField:
    name: str
    type: str
    """A key of :data:`PRIMITIVES`, ``string``, or the name of a message: ``std_msgs/Header``."""
    count: int | None
    """Length of a fixed array; 0: any length; None: no array."""

    @property
    def nested(self) -> bool:
        return "/" in self.type


@dataclasses.dataclass(frozen=True)
class MessageType:
    name: str
    """Package and type: ``contactfpga_msgs/Zones``."""
    fields: tuple[MessageField, ...]
    constants: tuple[tuple[str, int], ...]
    text: str

    def constant(self, name: str) -> int:
        return dict(self.constants)[name]


@functools.cache
def message_type(name: str) -> MessageType:
    """A type by its name: ours, or one of :data:`STANDARD`. Raises KeyError."""
    package, _, short = name.partition("/")
    if package != PACKAGE:
        return _parsed(name, STANDARD[name])
    path = messages() / f"{short}.msg"
    if not path.is_file():
        raise KeyError(name)
    return _parsed(name, path.read_text(encoding="utf-8"))


def needed(name: str) -> list[MessageType]:
    """All types nested in a type, each once, sorted by name."""
    found: dict[str, MessageType] = {}
    todo = [name]
    while todo:
        for field in message_type(todo.pop()).fields:
            if field.nested and field.type not in found:
                found[field.type] = message_type(field.type)
                todo.append(field.type)
    return [found[name] for name in sorted(found)]


def schema(name: str) -> str:
    """The text of a type with those of all nested types, as in recordings (encoding ``ros2msg``)."""
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


def _field(package: str, kind: str, name: str) -> MessageField:
    kind, bracket, size = kind.partition("[")
    if kind not in PRIMITIVES and kind != "string" and "/" not in kind:
        kind = f"{package}/{kind}"
    return MessageField(name, kind, int(size.rstrip("]") or 0) if bracket else None)


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
"""Increments of a type's number for an array of fixed and of any length."""


@functools.cache
def type_hash(name: str) -> str:
    """Hash of a type: ``RIHS01_`` and 64 hexadecimal digits."""
    described = {
        "type_description": _described(message_type(name)),
        "referenced_type_descriptions": [_described(one) for one in needed(name)],
    }
    return "RIHS01_" + hashlib.sha256(json.dumps(described).encode()).hexdigest()


def _described(kind: MessageType) -> dict[str, Any]:
    return {"type_name": _full(kind.name), "fields": [_described_field(field) for field in kind.fields]}


def _described_field(field: MessageField) -> dict[str, Any]:
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
