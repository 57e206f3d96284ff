"""Frames of sheets of many sizes, full to the last zone, through the whole driver."""

import itertools
import random

import numpy as np
import pytest
from model_board import DirectPort

import contactfpga
from contactfpga import Skin

SIZES = list(itertools.product(range(1, 65), range(1, 65)))
REPORTS = ("moments", "barycenter", "cells")


def full(skin):
    """Zones of a full frame, of a cell each: (area, sum x, sum y), in the report's units."""
    if skin.connectivity == 8:
        cells = itertools.product(range(0, skin.rows, 2), range(0, skin.columns, 2))
    else:
        cells = (cell for cell in itertools.product(range(skin.rows), range(skin.columns)) if sum(cell) % 2 == 0)
    step = 1 << skin.barycenter_bits if skin.report == "barycenter" else 1
    return [(1, column * step, row * step) for row, column in cells]


def check(rows, columns, connectivity, report):
    skin = Skin(rows=rows, columns=columns, connectivity=connectivity, report=report, settle_us=10_000.0)
    skin = skin.replace(zone_capacity=skin.max_zones())
    port = DirectPort(skin)
    port.moments = full(skin)
    assert len(port.moments) == skin.max_zones()
    with contactfpga.open(port) as board:
        zones = board.read()
        assert board.sheet == skin.sheet
        assert not board.stats.damaged
    if report == "cells":
        assert zones.cells.tolist() == [[bool(column % 2) for column in range(columns)]] * rows
        return
    step = 1 << skin.barycenter_bits if report == "barycenter" else 1
    places = np.array(port.moments)[:, 1:] / step * 10.0
    assert sorted(map(tuple, zones.array[["x_mm", "y_mm"]].tolist())) == sorted(map(tuple, places.tolist()))


@pytest.mark.parametrize("connectivity", [4, 8])
@pytest.mark.parametrize("report", REPORTS)
def test_full_frames_of_some_sheets_arrive(connectivity, report):
    rng = random.Random(f"{connectivity} {report}")
    for rows, columns in [(1, 1), (64, 64), (32, 32), (64, 1), (1, 64), *rng.sample(SIZES, 12)]:
        check(rows, columns, connectivity, report)


def test_no_frame_is_too_long_for_the_reader(monkeypatch):
    """The limit that once stood here let frames of over 1,556 bytes never reach a program."""
    monkeypatch.setattr("contactfpga.driver.conversation.LONGEST_PACKET", 1556)
    with pytest.raises(contactfpga.ReadTimeout):
        check(64, 64, 4, "moments")


@pytest.mark.parametrize(
    "skin",
    [
        Skin(rows=2, surface="cylinder", radius_mm=25.464791),  # its ends nearly meet, as a rounded radius would
        Skin(rows=1, columns=1, pitch_x_mm=0.01, pitch_y_mm=1000.0),
        Skin(rows=3, columns=2, settle_us=10_000.0, release_us=10_000.0, clock_hz=1_000_000, baud=1200, name="ä" * 16),
        Skin(diodes="none", connectivity=4, clock_hz=400_000_000),
    ],
)
def test_what_a_skin_accepts_the_host_accepts(skin):
    port = DirectPort(skin)
    port.moments = [(1, 0, 0)]
    for expected in (None, skin):
        with contactfpga.open(port, expected) as board:
            assert board.read().sheet == skin.sheet
            assert (board.clock_hz, board.baud, board.name) == (skin.clock_hz, skin.baud, skin.name)
