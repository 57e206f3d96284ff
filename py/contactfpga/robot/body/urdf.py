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
from contactfpga.robot.body.kinematics import MOVING, Joint, Pose, Robot, rotation_about
from contactfpga.robot.body.state import BodyError
from contactfpga.surfaces.shapes import Vector

if TYPE_CHECKING:
    from xml.etree import ElementTree

MAX_BYTES = 20_000_000
MAX_LINKS = 1000
VERSIONS = ("1.0", "1.1", "1.2")
XACRO = {f"xacro:{name}" for name in ("arg", "if", "include", "insert_block", "macro", "property", "unless")}
"""Elements that expansion removes. It leaves calls of macros that it does not know, in robots that are in use."""
FREE = ("floating", "planar")
"""Kinds of joints without an angle, which only a base has."""
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
    """The outermost element of a file whose origins can be read. Raises :class:`BodyError`, OSError."""
    data = read_small(path, MAX_BYTES, "a URDF file", BodyError)
    root = xmlfile.parse(data, path, "a URDF file", BodyError, lenient=True)
    if root.tag != "robot":
        raise BodyError(f"{path}: its outermost element is {shown(root.tag)}; in a URDF it is 'robot'")
    version = root.get("version", VERSIONS[0]).strip()
    if version not in VERSIONS:
        raise BodyError(f"{path}: version is {shown(version)}; known are {', '.join(VERSIONS)}")
    for element in root.iter():
        if element.tag in XACRO or any("${" in value for value in element.attrib.values()):
            raise BodyError(f"{path}: this is xacro; expand it with `xacro FILE > expanded.urdf`")
        if element.tag == "origin" and version == VERSIONS[0] and "quat_xyzw" in element.attrib:
            raise BodyError(f'{path}: ROS ignores quat_xyzw before URDF 1.1; write <robot version="1.1">')
    return root


def _robot(root: ElementTree.Element) -> Robot:
    listed, hung = root.findall("link"), root.findall("joint")
    for what, found in (("links", listed), ("joints", hung)):
        if len(found) > MAX_LINKS:
            raise BodyError(f"{len(found):,} {what}; the limit is {MAX_LINKS:,}")
    links = [_text(link, "name", "a link") for link in listed]
    if twice := [link for link in set(links) if links.count(link) > 1]:
        raise BodyError(f"two links are named {shown(min(twice))}")
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
    _free_base(links, joints)
    for joint in joints.values():
        if joint.mimic is not None and joint.mimic[0] not in joints:
            raise BodyError(f"joint {shown(joint.name)} follows {shown(joint.mimic[0])}, which is not there")
    roots = list(set(links).difference(joint.child for joint in joints.values()))
    if len(roots) != 1:
        raise BodyError(
            f"{len(roots)} links hang on no joint; a robot has one base" if links else "no link; is it xacro?"
        )
    return Robot(root.get("name", ""), tuple(links), joints, roots[0])


def _free_base(links: list[str], joints: dict[str, Joint]) -> None:
    """Remove the world from under a base that moves freely."""
    for joint in [joint for joint in joints.values() if joint.kind in FREE]:
        if sum(joint.parent in (one.parent, one.child) for one in joints.values()) > 1:
            where = f"joint {shown(joint.name)} is of type {shown(joint.kind)}"
            raise BodyError(f"{where}; only the single joint of the outermost link may be, so make it fixed")
        del joints[joint.name]
        links.remove(joint.parent)


def _joint(element: ElementTree.Element) -> Joint:
    name = _text(element, "name", "a joint")
    where = f"joint {shown(name)}"
    kind = element.get("type", "")
    if kind not in (*MOVING, *FREE, "fixed"):
        raise BodyError(f"{where} is of type {shown(kind)}; it must be one of {', '.join((*MOVING, 'fixed', *FREE))}")
    ends = [_text(_child(element, tag, where), "link", f"{tag} of {where}") for tag in ("parent", "child")]
    axis = np.zeros(3)
    if kind in MOVING:
        given = element.find("axis")
        axis = np.array((1.0, 0.0, 0.0) if given is None else vector(given, "xyz", where))
        length = float(np.linalg.norm(axis))
        if length < 1e-9:
            raise BodyError(f"the axis of {where} has no direction")
        axis = axis / length
    return Joint(name, kind, ends[0], ends[1], pose(element.find("origin"), where), axis, _mimic(element, where))


def _mimic(element: ElementTree.Element, where: str) -> tuple[str, float, float] | None:
    mimic = element.find("mimic")
    if mimic is None:
        return None
    factor, offset = (_number(mimic.get(key, usual), where) for key, usual in (("multiplier", "1"), ("offset", "0")))
    return _text(mimic, "joint", f"mimic of {where}"), factor, offset


def _child(element: ElementTree.Element, tag: str, where: str) -> ElementTree.Element:
    found = element.find(tag)
    if found is None:
        raise BodyError(f"{where} has no {tag}")
    return found


def _text(element: ElementTree.Element, key: str, where: str) -> str:
    if not (found := element.get(key)):
        raise BodyError(f"{where} has no {key}")
    return found


def pose(origin: ElementTree.Element | None, where: str) -> Pose:
    """The pose that an ``<origin>``, by default none, gives to ``where``. Raises :class:`BodyError`."""
    given = {} if origin is None else origin.attrib
    if other := given.keys() - {"xyz", "quat_xyzw" if "quat_xyzw" in given else "rpy"}:
        raise BodyError(f"the origin of {where} has {shown(min(other))}; it may have xyz, and rpy or quat_xyzw")
    moved = Pose.of(*(vector(origin, key, where) for key in ("xyz", "rpy")))
    x, y, z, w = _numbers(given.get("quat_xyzw", "0 0 0 1"), "quat_xyzw", where, 4)
    size = math.hypot(x, y, z)  # 0 without a turn, and for ROS also where all four are 0
    turned = rotation_about(np.array((x, y, z)) / (size or 1.0), 2 * math.atan2(size, w))
    return Pose(moved.rotation @ turned, moved.point_m)


def vector(element: ElementTree.Element | None, key: str, where: str, usual: str = "0 0 0") -> Vector:
    """Three numbers, by default ``usual``, that belong to ``where``. Raises :class:`BodyError`."""
    x, y, z = _numbers(usual if element is None else element.get(key, usual), key, where, 3)
    return x, y, z


def _numbers(text: str, key: str, where: str, count: int) -> list[float]:
    parts = text.split()
    if len(parts) != count:
        raise BodyError(f"{key} of {where} is {shown(text)}; it must be {'three' if count == 3 else 'four'} numbers")
    return [_number(part, where) for part in parts]


def _number(text: str, where: str) -> float:
    value = number_in(text)
    if not math.isfinite(value):
        raise BodyError(f"{where} says {shown(text)} where a finite number is due")
    return value
