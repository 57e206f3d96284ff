"""Zones labelled on the host with OpenCV's connected components."""

from __future__ import annotations

import dataclasses
import statistics
import time
from collections.abc import Sequence

import cv2
import numpy as np

from contactfpga_sim.lab.chart.compute import Point
from contactfpga_sim.model.scenes.families import touches

FRAMES, REPEATS = 20, 50


def zones(cells: np.ndarray, connectivity: int) -> list[tuple[int, float, float]]:
    """Area, x and y of each zone of (R, C) bool cells."""
    _, _, found, centroids = cv2.connectedComponentsWithStats(cells.view(np.uint8), connectivity=connectivity)
    return [
        (int(area), float(x), float(y)) for area, (x, y) in zip(found[1:, cv2.CC_STAT_AREA], centroids[1:], strict=True)
    ]


def label_us(frames: Sequence[np.ndarray], connectivity: int) -> float:
    """Microseconds of :func:`zones`: the median over frames of the median of calls."""
    return statistics.median(statistics.median(_once(cells, connectivity) for _ in range(REPEATS)) for cells in frames)


def _once(cells: np.ndarray, connectivity: int) -> float:
    start = time.perf_counter_ns()
    zones(cells, connectivity)
    return (time.perf_counter_ns() - start) / 1e3


def timed(point: Point) -> Point:
    task = point.task
    if task.skin.report != "cells":
        return point
    scenes = touches(task.family, FRAMES, task.seed, task.skin, task.cover)
    frames = [scene.pressed(scene.settled_s, task.skin, task.cover) for scene in scenes]
    return dataclasses.replace(point, host_us=label_us(frames, task.skin.connectivity))
