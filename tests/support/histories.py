"""Histories of frames of a sheet that hands move over, with what is wrong with it planted."""

import numpy as np
from scipy import ndimage

from contactfpga.wire.protocol import NO_RECORDS, Frame
from contactfpga.zones.zone import Zones

RATE_HZ = 40.0


def frames(skin, cells, rate_hz=RATE_HZ, start_us=0):
    """The frames of (n, rows, columns) bool cells, as a board of this Skin reports them."""
    for index, pressed in enumerate(cells):
        yield frame(skin, pressed, start_us + round(index * 1e6 / rate_hz), index)


def frame(skin, pressed, time_us, sequence=0):
    found = None if skin.report == "cells" else records(skin, pressed)
    divided = skin.report == "barycenter"
    sent = Frame(
        sequence=sequence % 256,
        time_us=time_us % 2**24,
        flags=frozenset(),
        overwritten=0,
        heard=1,
        zones=0 if found is None else len(found),
        cells=int(pressed.sum()),
        moments=NO_RECORDS if found is None or divided else found,
        bitmap=pressed if found is None else None,
        barycenters=found if divided else None,
    )
    return Zones(sent, skin.sheet, time_us)


def records(skin, pressed):
    """Area and sums, or barycenters, of the zones."""
    shape = np.ones((3, 3)) if skin.connectivity == 8 else None
    numbers, count = ndimage.label(pressed, shape)
    rows = []
    for number in range(1, count + 1):
        y, x = np.nonzero(numbers == number)
        area, sum_x, sum_y = len(x), int(x.sum()), int(y.sum())
        if skin.report == "barycenter":
            steps = 2**skin.barycenter_bits
            sum_x, sum_y = (int(np.floor(steps * one / area + 0.5)) for one in (sum_x, sum_y))
        rows.append((area, sum_x, sum_y))
    return np.array(rows, np.int64).reshape(-1, 3)


def moving_touches(rng, skin, seconds, hands=3, rate_hz=RATE_HZ):
    """(n, rows, columns) bool: each hand puts a fingertip or a palm somewhere, moves it by a pitch and more, lifts it
    after 4 s at most, and goes on elsewhere."""
    count = round(seconds * rate_hz)
    cells = np.zeros((count, skin.rows, skin.columns), bool)
    y, x = np.mgrid[: skin.rows, : skin.columns]
    size = np.array([skin.rows, skin.columns])
    for _ in range(hands):
        at = int(rng.integers(0, 40))
        while at < count:
            steps = min(int(rng.integers(8, 160)), count - at)
            radius = rng.uniform(0.8, 2.2)
            start = rng.uniform(-0.5, size - 0.5)
            turn, way = rng.uniform(0, 2 * np.pi), rng.uniform(1.5, 6.0)
            places = start + np.linspace(0, way, steps)[:, None] * [np.sin(turn), np.cos(turn)]
            for index, (row, column) in enumerate(places, at):
                cells[index] |= (y - row) ** 2 + (x - column) ** 2 <= radius**2
            at += steps + int(rng.integers(8, 80))
    return cells
