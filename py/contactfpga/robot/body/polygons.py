"""Convex polygons in a plane: (n, 2) corners, counterclockwise. Fewer than three corners are a point or a segment."""

from __future__ import annotations

import math
from collections.abc import Iterable

Point = tuple[float, float]


def hull(points: Iterable[Point]) -> list[Point]:
    """The corners of the convex hull of points, by a monotone chain (Andrew 1979). In plain Python, because numpy takes
    longer for the few points of a zone."""
    ordered = sorted(set(points))
    if len(ordered) < 3:
        return ordered
    return _chain(ordered) + _chain(ordered[::-1])


def _chain(points: list[Point]) -> list[Point]:
    found: list[Point] = []
    for point in points:
        while len(found) > 1:
            (ax, ay), (bx, by) = found[-2], found[-1]
            if (bx - ax) * (point[1] - ay) > (by - ay) * (point[0] - ax):
                break
            found.pop()
        found.append(point)
    return found[:-1]


def grown(corners: Iterable[Point], by_x: float, by_y: float) -> list[Point]:
    """The polygon with a rectangle of these half sides around each of its points."""
    return hull((x + i * by_x, y + j * by_y) for x, y in corners for i in (-1, 1) for j in (-1, 1))


def within(corners: list[Point], other: list[Point]) -> list[Point]:
    """The part of a polygon within another one of three corners or more, by Sutherland and Hodgman; [] if they do not
    meet."""
    for (ax, ay), (bx, by) in zip(other, other[1:] + other[:1]):
        ends = [((bx - ax) * (y - ay) - (by - ay) * (x - ax), x, y) for x, y in corners]
        corners = []
        for (before, u, v), (after, x, y) in zip(ends[-1:] + ends[:-1], ends):
            if (before < 0) != (after < 0):
                part = before / (before - after)
                corners.append((u + part * (x - u), v + part * (y - v)))
            if after >= 0:
                corners.append((x, y))
    return corners


def area(corners: list[Point]) -> float:
    """Area of a polygon."""
    pairs = zip(corners, corners[1:] + corners[:1])
    return sum(x * v - u * y for (x, y), (u, v) in pairs) / 2


def depth(corners: list[Point], point: Point) -> float:
    """Distance of a point from the edge of a polygon: above 0 within it, below 0 outside; -inf without corners."""
    x, y = point
    found, nearest = math.inf, math.inf
    for (ax, ay), (bx, by) in zip(corners, corners[1:] + corners[:1]):
        wide = (bx - ax) ** 2 + (by - ay) ** 2
        part = min(1.0, max(0.0, ((x - ax) * (bx - ax) + (y - ay) * (by - ay)) / wide)) if wide else 0.0
        nearest = min(nearest, math.hypot(x - ax - part * (bx - ax), y - ay - part * (by - ay)))
        found = min(found, (bx - ax) * (y - ay) - (by - ay) * (x - ax))
    return nearest if found >= 0 and len(corners) > 2 else -nearest


def edges_split(corners: list[Point], longest: float) -> list[Point]:
    """The corners with more points between them, none further from the next than ``longest``."""
    found = []
    for (ax, ay), (bx, by) in zip(corners, corners[1:] + corners[:1]):
        steps = max(1, math.ceil(math.hypot(bx - ax, by - ay) / longest))
        found += [(ax + (bx - ax) * k / steps, ay + (by - ay) * k / steps) for k in range(steps)]
    return found
