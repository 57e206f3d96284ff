"""The words of an SVG picture and the places that they take, by the widest font that a reader is likely to have."""

from __future__ import annotations

import functools
import itertools
import math
import re
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.font_manager import FontProperties
from matplotlib.textpath import TextPath

SVG = "{http://www.w3.org/2000/svg}"
NUMBER = r"-?[\d.]+(?:e-?\d+)?"


class Words(NamedTuple):
    """A line of text."""

    text: str
    pixels: float
    """Size of its font, in units of the picture."""
    corners: np.ndarray
    """(4, 2), around what is inked, in turn."""


class Picture(NamedTuple):
    """What a picture's texts are, and how large it is."""

    width: float
    height: float
    words: tuple[Words, ...]


@functools.cache
def read(path: Path) -> Picture:
    """The texts of the picture in this file."""
    root = ElementTree.parse(path).getroot()
    _, _, width, height = map(float, root.attrib["viewBox"].split())
    return Picture(width, height, tuple(_walk(root, np.eye(3), {})))


def overlapping(picture: Picture) -> list[tuple[str, str]]:
    """Every two texts that lie on each other."""
    least = np.array([one.corners.min(axis=0) for one in picture.words])
    most = np.array([one.corners.max(axis=0) for one in picture.words])
    near = (least[:, None] < most[None]).all(axis=2) & (least[None] < most[:, None]).all(axis=2)
    pairs = [pair for pair in itertools.combinations(range(len(least)), 2) if near[pair]]
    words = [(picture.words[first], picture.words[second]) for first, second in pairs]
    return [(one.text, other.text) for one, other in words if overlap(one, other)]


def overlap(one: Words, other: Words) -> bool:
    """True if the two rectangles have more than a rim in common: no side of either one parts them."""
    for corners in (one.corners, other.corners):
        for start, end in zip(corners, np.roll(corners, 1, axis=0)):
            across = np.array([-(end - start)[1], (end - start)[0]])
            across /= np.hypot(*across)
            first, second = one.corners @ across, other.corners @ across
            if min(first.max(), second.max()) - max(first.min(), second.min()) < 0.5:
                return False
    return True


def _walk(node: ElementTree.Element, places: np.ndarray, style: dict[str, str]) -> Iterator[Words]:
    places = places @ _transform(node.get("transform", ""))
    style = style | _style(node)
    if node.tag == f"{SVG}text" and (text := "".join(node.itertext()).strip()):
        yield _words(text, node, places, style)
    else:
        for child in node:
            yield from _walk(child, places, style)


def _style(node: ElementTree.Element) -> dict[str, str]:
    names = ("font-size", "font-weight", "font-family", "text-anchor")
    found = {name: node.attrib[name] for name in names if name in node.attrib}
    for line in node.get("style", "").split(";"):
        name, _, value = line.partition(":")
        found[name.strip()] = value.strip()
    if short := re.match(r"(?:(bold|\d+) )?([\d.]+)px (.*)", found.pop("font", "")):
        found |= {"font-weight": short[1] or "", "font-size": short[2], "font-family": short[3]}
    return {name: value for name, value in found.items() if name in names}


def _words(text: str, node: ElementTree.Element, places: np.ndarray, style: dict[str, str]) -> Words:
    size = float(style.get("font-size", "16").removesuffix("px"))
    weight = "bold" if style.get("font-weight", "") in ("bold", "600", "700") else "normal"
    family = "DejaVu Sans Mono" if "mono" in style.get("font-family", "").lower() else "DejaVu Sans"
    start, end, low, high = (size * share for share in _ink(text, family, weight))
    left = {"middle": -end / 2, "end": -end}.get(style.get("text-anchor", ""), 0.0)
    x, y = float(node.get("x", 0)) + left, float(node.get("y", 0))
    box = [(start + x, y - high), (end + x, y - high), (end + x, y - low), (start + x, y - low)]
    corners = (places @ np.array([(*corner, 1.0) for corner in box]).T).T[:, :2]
    scale = math.sqrt(abs(np.linalg.det(places[:2, :2])))
    return Words(text, size * scale, corners)


@functools.cache
def _ink(text: str, family: str, weight: str) -> tuple[float, float, float, float]:
    """From where to where the letters reach along the line and above it, for a font of size 1."""
    ink = TextPath((0, 0), text, size=100, prop=FontProperties(family=family, weight=weight)).get_extents()
    return ink.x0 / 100, ink.x1 / 100, ink.y0 / 100, ink.y1 / 100


def _transform(text: str) -> np.ndarray:
    found = np.eye(3)
    for name, inside in re.findall(r"(\w+)\(([^)]*)\)", text):
        values = [float(value) for value in re.findall(NUMBER, inside)]
        found = found @ _matrix(name, values)
    return found


def _matrix(name: str, values: list[float]) -> np.ndarray:
    if name == "rotate":
        angle, x, y = math.radians(values[0]), *(values[1:] or (0.0, 0.0))
        cos, sin = math.cos(angle), math.sin(angle)
        return np.array([[cos, -sin, x - cos * x + sin * y], [sin, cos, y - sin * x - cos * y], [0, 0, 1]])
    if name == "scale":
        return np.diag([values[0], values[-1], 1.0])
    if name == "translate":
        return np.array([[1, 0, values[0]], [0, 1, (*values, 0.0)[1]], [0, 0, 1.0]])
    raise ValueError(f"transform {name!r} is not known")
