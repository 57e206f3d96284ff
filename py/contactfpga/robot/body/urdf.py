"""Links and joints from a URDF file, without masses, meshes and colors."""

from __future__ import annotations

import importlib.util
import math
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from contactfpga.errors import pip_install
from contactfpga.inputs import xmlfile
from contactfpga.inputs.files import read_small
from contactfpga.inputs.values import number_in, shown
from contactfpga.robot.body.kinematics import MOVING, Joint, Pose, Robot
from contactfpga.robot.body.state import BodyError
from contactfpga.surfaces.shapes import Vector

if TYPE_CHECKING:
    from xml.etree import ElementTree

MAX_BYTES = 20_000_000
MAX_LINKS = 1000
PACKAGE = "package://"


def located(urdf: str, folder: Path) -> Path:
    """The file named in a robot's table: a path relative to ``folder``, or ``package://NAME/PATH`` in an installed
    package. Raises :class:`BodyError`."""
    if not urdf.startswith(PACKAGE):
        return folder / urdf
    name, _, inside = urdf.removeprefix(PACKAGE).partition("/")
    found = importlib.util.find_spec(name) if name.isidentifier() else None
    if found is None or not found.submodule_search_locations:
        raise BodyError(
            f"urdf is {shown(urdf)}; no Python package {shown(name)} is installed: install it, for the example with "
            f"{pip_install('body')}"
        )
    if ".." in Path(inside).parts or Path(inside).is_absolute():
        raise BodyError(f"urdf is {shown(urdf)}; it must name a file inside the package")
    return Path(next(iter(found.submodule_search_locations))) / inside


def load(path: Path) -> Robot:
    root = tree(path)
    try:
        return _robot(root)
    except BodyError as error:
        raise BodyError(f"{path}: {error}") from None


def tree(path: Path) -> ElementTree.Element:
    data = read_small(path, MAX_BYTES, "a URDF file", BodyError)
    return xmlfile.parse(data, path, "a URDF file", BodyError)


def _robot(root: ElementTree.Element) -> Robot:
    if root.tag != "robot":
        raise BodyError(f"its outermost element is {shown(root.tag)}; in a URDF it is 'robot'")
    listed, hung = root.findall("link"), root.findall("joint")
    for what, found in (("links", listed), ("joints", hung)):
        if len(found) > MAX_LINKS:
            raise BodyError(f"{len(found):,} {what}; the limit is {MAX_LINKS:,}")
    links = tuple(_text(link, "name", "a link") for link in listed)
    joints: dict[str, Joint] = {}
    for element in hung:
        joint = _joint(element)
        if joint.name in joints:
            raise BodyError(f"two joints are named {shown(joint.name)}")
        joints[joint.name] = joint
    there, children = set(links), set[str]()
    for joint in joints.values():
        for link in (joint.parent, joint.child):
            if link not in there:
                raise BodyError(f"joint {shown(joint.name)} names the link {shown(link)}, which is not there")
        if joint.child in children:
            raise BodyError(f"link {shown(joint.child)} hangs on two joints; a URDF is a tree")
        children.add(joint.child)
        if joint.mimic is not None and joint.mimic[0] not in joints:
            raise BodyError(f"joint {shown(joint.name)} follows {shown(joint.mimic[0])}, which is not there")
    roots = [link for link in links if link not in children]
    if len(roots) != 1:
        raise BodyError(f"{len(roots)} links hang on no joint; a robot has one base")
    return Robot(root.get("name", ""), links, joints, roots[0])


def _joint(element: ElementTree.Element) -> Joint:
    name = _text(element, "name", "a joint")
    where = f"joint {shown(name)}"
    kind = element.get("type", "")
    if kind not in (*MOVING, "fixed"):
        raise BodyError(f"{where} is of type {shown(kind)}; it must be one of {', '.join(MOVING)}, fixed")
    ends = [_text(_child(element, tag, where), "link", f"{tag} of {where}") for tag in ("parent", "child")]
    placed = element.find("origin")
    point, rpy = (vector(placed, key, where) for key in ("xyz", "rpy"))
    axis = np.zeros(3)
    if kind in MOVING:
        told = element.find("axis")
        axis = np.array((1.0, 0.0, 0.0) if told is None else vector(told, "xyz", where))
        length = float(np.linalg.norm(axis))
        if length < 1e-9:
            raise BodyError(f"the axis of {where} has no direction")
        axis = axis / length
    return Joint(name, kind, ends[0], ends[1], Pose.of(point, rpy), axis, _mimic(element, where))


def _mimic(element: ElementTree.Element, where: str) -> tuple[str, float, float] | None:
    told = element.find("mimic")
    if told is None:
        return None
    factor, offset = (_number(told.get(key, usual), where) for key, usual in (("multiplier", "1"), ("offset", "0")))
    return _text(told, "joint", f"mimic of {where}"), factor, offset


def _child(element: ElementTree.Element, tag: str, where: str) -> ElementTree.Element:
    found = element.find(tag)
    if found is None:
        raise BodyError(f"{where} has no {tag}")
    return found


def _text(element: ElementTree.Element, key: str, where: str) -> str:
    if not (found := element.get(key)):
        raise BodyError(f"{where} has no {key}")
    return found


def vector(element: ElementTree.Element | None, key: str, where: str, usual: str = "0 0 0") -> Vector:
    """Three numbers, by default ``usual``, that belong to ``where``. Raises :class:`BodyError`."""
    text = usual if element is None else element.get(key, usual)
    parts = text.split()
    if len(parts) != 3:
        raise BodyError(f"{key} of {where} is {shown(text)}; it must be three numbers")
    x, y, z = (_number(part, where) for part in parts)
    return x, y, z


def _number(text: str, where: str) -> float:
    value = number_in(text)
    if not math.isfinite(value):
        raise BodyError(f"{where} says {shown(text)} where a finite number is due")
    return value
