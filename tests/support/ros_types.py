"""Our types as rosbags knows them, which reads and writes them on its own; and what Cyclone DDS reads."""

import dataclasses
import functools

import numpy as np
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from contactfpga.robot.ros import PACKAGE, messages

STORES = (Stores.ROS2_JAZZY, Stores.ROS2_KILTED)
OURS = sorted(f"{PACKAGE}/{path.stem}" for path in messages().glob("*.msg"))


def full(name):
    package, _, short = name.partition("/")
    return f"{package}/msg/{short}"


@functools.cache
def store(which=Stores.ROS2_KILTED):
    made = get_typestore(which)
    for name in OURS:
        path = messages() / f"{name.partition('/')[2]}.msg"
        made.register(get_types_from_msg(path.read_text(encoding="utf-8"), full(name)))
    return made


def plain(value):
    """What rosbags read, as mappings, lists, bytes, numbers and strings."""
    if hasattr(value, "__msgtype__"):
        names = [field.name for field in dataclasses.fields(value)]
        return {name: plain(getattr(value, name)) for name in names if name.islower() and name != "__msgtype__"}
    if isinstance(value, np.ndarray):
        return value.tobytes() if value.dtype == np.uint8 else value.tolist()
    if isinstance(value, (list, tuple)):
        return [plain(one) for one in value]
    return value
