"""A watch over sheets whose ends meet: the seam is no edge, and a zone without an x is given none."""

import numpy as np
import pytest
from histories import RATE_HZ, frame, moving_touches

from contactfpga import Skin, Watch
from contactfpga.wire.protocol import Frame
from contactfpga.zones.zone import Zones

SKIN = Skin(rows=16, columns=16, surface="cylinder", radius_mm=40.0, closed=True, report="cells")
MOMENTS = SKIN.replace(report="moments")
HANDS = moving_touches(np.random.default_rng(6), SKIN, 24.0)
HANDS[:, :, :2] = HANDS[:, :, -2:] = False


def beside(size):
    """Hands that leave room for something of this size in row 5, column 5."""
    cells = HANDS.copy()
    cells[:, 2 : 8 + size, 2 : 8 + size] = False
    return cells


def watched(cells, shift):
    """What is suspected on the sheet turned by ``shift`` columns, turned back; the same as found; the watch."""
    watch = Watch(SKIN, stuck_s=5.0)
    turned = np.roll(cells, shift, axis=2)
    found = [
        one
        for index, pressed in enumerate(turned)
        for one in watch.update(frame(SKIN, pressed, round(index * 1e6 / RATE_HZ)))
    ]
    back = [(one.kind, one.time_us, {(row, (column - shift) % 16) for row, column in one.cells}) for one in found]
    return back, found, watch


@pytest.mark.parametrize("shift", [0, 10])
def test_something_that_lies_on_the_seam_is_not_taken_for_stuck_switches(shift):
    cells = beside(2)
    cells[:, 5:7, 5:7] = True
    ((kind, _, where),), (one,), watch = watched(cells, shift)
    assert (kind, where) == ("held", {(5, 5), (5, 6), (6, 5), (6, 6)})
    assert watch.mask_line == ""
    assert f"4 cells about ({'6, 6' if shift == 0 else '6, 0'})" in one.sentence


def test_a_stuck_switch_is_reported_at_the_same_time_wherever_the_seam_lies():
    """Also where something beside it, over the seam, was touched lately."""
    cells = beside(1)
    cells[:, 5, 5] = True
    cells[150:330:4, 5, 4] = True  # a finger that taps beside it
    reported, _, _ = watched(cells, 0)
    assert [(kind, where) for kind, _, where in reported] == [("stuck", {(5, 5)})]
    assert reported[0][1] > 330 / RATE_HZ * 1e6
    for shift in (10, 11, 12):
        assert watched(cells, shift)[0] == reported


def sent(zones, time_us):
    """A frame of records (area, sum x, sum y, turned)."""
    records = np.array(zones, np.int64).reshape(-1, 4)
    cells = int(records[:, 0].sum())
    return Zones(
        Frame(0, time_us % (1 << 24), frozenset(), 0, 0, len(zones), cells, records, None), MOMENTS.sheet, time_us
    )


def watched_zones(lies, others):
    watch = Watch(MOMENTS, stuck_s=5.0)
    return [one for step in range(240) for one in watch.update(sent([lies, *others(step)], 25_000 * step))], watch


def finger(rows, columns):
    """A cell that goes over all of these, and is lifted between them."""
    path = [(row, column) for row in rows for column in columns]
    return lambda step: [] if step % 2 else [(1, *path[step // 2 % len(path)][::-1], 0)]


@pytest.mark.parametrize(("turned", "name"), [(16, "a ring"), (511, "wound")])
def test_a_zone_around_the_sheet_that_lies_there_is_reported_without_an_x(turned, name):
    (one,), watch = watched_zones((16, 120, 80, turned), finger(range(12, 16), range(16)))
    assert one.kind == "held"
    assert "x " not in one.sentence
    assert f"a zone of 16 cells at y 50.0 mm, {name} around the sheet" in one.sentence
    assert watch.mask_line == ""


def test_what_touches_a_zone_around_the_sheet_is_nowhere_else():
    """Beside it all the way round."""
    assert watched_zones((16, 120, 80, 16), finger([5, 6], range(16)))[0] == []


@pytest.mark.parametrize("column", [0, 15])
def test_what_touches_a_zone_over_the_seam_is_nowhere_else(column):
    over = [15, 14] if column == 0 else [0, 1]
    assert watched_zones((1, column, 5, 0), finger(range(3, 8), over))[0] == []
    (one,), watch = watched_zones((1, column, 5, 0), finger(range(4, 7), range(5, 11)))
    assert (one.kind, watch.stuck) == ("stuck", ((5, column),))


def test_a_stuck_switch_that_a_contact_over_the_seam_joins_stays_reported():
    watch = Watch(MOMENTS, stuck_s=5.0)
    others = finger(range(4, 7), range(5, 11))
    for step in range(240):
        watch.update(sent([(1, 0, 5, 0), *others(step)], 25_000 * step))
    assert watch.stuck == ((5, 0),)
    watch.update(sent([(3, 29, 15, 1)], 6_000_000))  # with columns 14 and 15
    assert watch.stuck == ((5, 0),)
