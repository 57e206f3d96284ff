"""Places and closings on a sheet whose ends meet: where the seam lies changes nothing."""

import math

import numpy as np
import pytest
from bumpers import flat, shown

from contactfpga.robot.haptics import (
    Center,
    Closing,
    ClosingWatch,
    HapticsError,
    LoadCells,
    Locator,
    Place,
    Plane,
    contacts,
    felt,
)
from contactfpga.skin import Skin
from contactfpga.wire.protocol import Frame
from contactfpga.zones.units import UnitSamples
from contactfpga.zones.zone import Zones
from contactfpga_sim.lab.haptics import coverage

COLUMNS = 12
AROUND_MM = 5.0 * COLUMNS
SKIN = Skin(rows=8, columns=COLUMNS, pitch_y_mm=5.0, surface="cylinder", radius_mm=AROUND_MM / 2 / math.pi, closed=True)
FINDER = Locator(SKIN.sheet, coverage.reach_of(coverage.POINT), 0.1, 0.5)
CELLS = [(3, 5), (3, 6), (4, 5), (4, 6)]
CLOSINGS = [Closing(3, 5, 5.0), Closing(3, 6, 9.0), Closing(4, 5, 12.0), Closing(4, 6, 16.0)]
CENTER = Place(27.5e-3, 17.5e-3, 1e-3, 1.6e-7 * np.eye(2), "center of pressure")


def turned(shift, closings=(), center=None):
    cells = [(row, (column + shift) % COLUMNS) for row, column in CELLS]
    closings = [Closing(one.row, (one.column + shift) % COLUMNS, one.force_n) for one in closings]
    if center is not None:
        x = (center.x_m + 5e-3 * shift) % (1e-3 * AROUND_MM)
        center = Place(x, center.y_m, center.radius_m, center.covariance_m2, center.method)
    return FINDER.locate(cells, 30.0, closings, center)


@pytest.mark.parametrize("shift", [5, 6, 7])
@pytest.mark.parametrize("known", [{}, {"closings": CLOSINGS}, {"closings": CLOSINGS, "center": CENTER}])
def test_a_place_goes_with_the_contact_over_the_seam(shift, known):
    straight, over = turned(0, **known), turned(shift, **known)
    assert over.x_m == pytest.approx((straight.x_m + 5e-3 * shift) % (1e-3 * AROUND_MM), abs=1e-9)
    assert (over.y_m, over.radius_m) == pytest.approx((straight.y_m, straight.radius_m))
    assert (over.method, over.agrees) == (straight.method, straight.agrees)


def test_cells_all_the_way_round_have_no_place():
    with pytest.raises(HapticsError, match="all the way round"):
        FINDER.locate([(3, column) for column in range(COLUMNS)], 30.0)


def test_a_center_of_pressure_lies_from_0_to_the_circumference():
    radius_m = AROUND_MM / 2e3 / math.pi
    for angle, x_mm in ((-0.02, AROUND_MM - 0.02 * 1e3 * radius_m), (0.02, 0.02 * 1e3 * radius_m)):
        point = radius_m * math.cos(angle), radius_m * math.sin(angle), 0.01
        push = Center(point, point, 5.0, 0.0, 0.0, point, (angle * radius_m, 0.01), 1e-8 * np.eye(2))
        assert FINDER.center(push).x_m == pytest.approx(1e-3 * x_mm)


def frame(cells, number, report):
    """One zone, which the units feel the more the larger it is."""
    return shown(SKIN.replace(report=report), cells, number, 3.0 * (1 + len(cells)))


@pytest.mark.parametrize("report", ["moments", "cells"])
@pytest.mark.parametrize("shift", [0, 5, 6, 7])
@pytest.mark.parametrize(
    "steps",
    [
        [[(3, 5)], [(3, 5), (3, 6)], [(3, 5), (3, 6), (4, 5), (4, 6)]],
        [[(3, 6)], [(3, 5), (3, 6), (4, 6)]],
        [[(3, 5), (3, 6)], [(3, 5)]],
        [[(3, 6), (4, 6)], [(2, 5), (3, 6), (4, 6)]],
    ],
)
def test_closings_are_found_over_the_seam(steps, shift, report):
    watch = ClosingWatch(LoadCells(flat().units, surface=Plane()))
    watch.take(frame([], 0, report))
    for number, cells in enumerate(steps, 1):
        watch.take(frame([(row, column + shift) for row, column in cells], number, report))
    assert watch.complete
    assert watch.cells == sorted((row, (column + shift) % COLUMNS) for row, column in steps[-1])


@pytest.mark.parametrize("shift", [0, 5, 6, 7])
def test_three_in_a_row_are_not_taken_for_three_in_a_column(shift):
    """Which have the same sums, so that nobody knows."""
    watch = ClosingWatch(LoadCells(flat().units, surface=Plane()))
    for number, columns in enumerate([[], [5], [4, 5, 6]]):
        watch.take(frame([(3, column + shift) for column in columns], number, "moments"))
    assert not watch.complete


def test_a_zone_around_the_sheet_leaves_the_forces_unknown():
    """Whoever grips the sheet pushes as well: the finger beside the hand does not exert it all."""
    cells = LoadCells(flat().units, surface=Plane())
    finger, ring = (4, 12, 4, 0), (COLUMNS, sum(range(COLUMNS)), 5 * COLUMNS, COLUMNS)
    for records, known in (([finger], True), ([finger, ring], False), ([ring], False)):
        pressed = sum(record[0] for record in records)
        sent = Frame(0, 0, frozenset(), 0, 0, len(records), pressed, np.array(records, np.int64), None)
        zones = Zones(sent, SKIN.sheet)
        zones._units = UnitSamples(0, (3.0,) * 3, (0.0,) * 3, (False,) * 3)
        assert (felt(cells, zones) is not None) is known
        if not known:
            with pytest.raises(HapticsError, match=r"a zone at y 25\.0 mm is a ring"):
                contacts(cells.wrench(zones.units.readings), zones, cells.surface)
