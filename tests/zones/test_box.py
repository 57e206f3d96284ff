"""Boxes of zones, from a board's cells to programs, and extents on the wire that cannot be.

Only these tests see rows taken for columns, an edge half a pitch off, or a box that is given to another zone.
"""

import numpy as np
import pytest
from frames import frame_in
from scipy import ndimage
from wire import Wire

import contactfpga
from contactfpga.skin.derived import Widths
from contactfpga.wire import protocol
from contactfpga.wire.protocol import PacketError
from contactfpga.zones.zone import Zones
from contactfpga_sim import VirtualBoard

OPEN = contactfpga.Skin(rows=5, columns=8, pitch_x_mm=4.0, pitch_y_mm=7.0, extent=True)
DIVIDED = OPEN.replace(report="barycenter", barycenter_bits=1)
CLOSED = contactfpga.Skin(rows=5, columns=8, radius_mm=20.0, surface="cylinder", closed=True, extent=True)


def zones_of(skin, records):
    return Zones(frame_in(Wire(skin).zones(records), skin), skin.sheet)


@pytest.mark.parametrize("skin", [OPEN, DIVIDED, OPEN.replace(labeller="serial", connectivity=4)], ids=str)
def test_a_board_tells_the_box_of_each_zone(skin):
    cells = np.random.default_rng(4).random((5, 8)) < 0.3
    labels, _ = ndimage.label(cells, ndimage.generate_binary_structure(2, 1 + (skin.connectivity == 8)))
    with contactfpga.open(VirtualBoard(skin, scene=lambda _: cells)) as board:
        zones = board.read()
    found = {(zone.area_cells, zone.box, zone.box_mm) for zone in zones}
    wanted = set()
    for number, (rows, columns) in enumerate(ndimage.find_objects(labels), 1):
        box = (columns.start, columns.stop - 1, rows.start, rows.stop - 1)
        corner, size = (columns.start * 4.0 - 2.0, rows.start * 7.0 - 3.5), (columns, rows)
        lengths = [(side.stop - side.start) * pitch for side, pitch in zip(size, (4.0, 7.0))]
        wanted.add((int((labels == number).sum()), box, (*corner, *lengths)))
    assert found == wanted
    assert len(zones) > 2


def test_a_box_goes_over_the_seam_or_all_the_way_around():
    over, ring = zones_of(CLOSED, [(3, 13, 3, 1, 6, 0, 1, 1), (8, 28, 16, 8, 0, 7, 2, 2)])
    pitch = CLOSED.pitch_x_mm
    assert over.box == contactfpga.Box(left=6, right=0, top=1, bottom=1)
    assert over.box_mm == pytest.approx((5.5 * pitch, 5.0, 3 * pitch, 10.0))
    assert over.box_mm.x_mm < over.x_mm < over.box_mm.x_mm + over.box_mm.width_mm
    assert (ring.box, ring.x_mm) == ((0, 7, 2, 2), None)


def test_without_extents_there_is_no_box():
    (zone,) = zones_of(OPEN.replace(extent=False), [(1, 5, 3)])
    assert (zone.box, zone.box_mm) == (None, None)


GOOD = {OPEN: (4, 10, 6, 2, 3, 1, 2), DIVIDED: (4, 5, 3, 2, 3, 1, 2), CLOSED: (3, 13, 3, 1, 6, 0, 1, 1)}
BAD = {
    OPEN: [
        (4, 10, 6, 3, 2, 1, 2),  # from right to left
        (4, 10, 6, 2, 3, 2, 1),  # from below to above
        (4, 10, 6, 2, 3, 1, 5),  # beyond the last row
        (5, 12, 8, 2, 3, 1, 2),  # more cells than places
        (2, 5, 3, 1, 4, 1, 2),  # wider than so many cells reach
        (4, 10, 6, 3, 4, 1, 2),  # right of the barycenter
        (4, 10, 6, 2, 3, 2, 3),  # below the barycenter
    ],
    DIVIDED: [(4, 5, 3, 3, 4, 1, 2), (4, 5, 3, 2, 3, 2, 3)],
    CLOSED: [
        (3, 13, 3, 1, 0, 2, 1, 1),  # right of the barycenter
        (3, 13, 3, 0, 6, 0, 1, 1),  # which is elsewhere
        (8, 28, 16, 8, 1, 0, 2, 2),  # a ring from its second column on
    ],
}


@pytest.mark.parametrize(("skin", "record"), [(skin, record) for skin, records in BAD.items() for record in records])
def test_an_extent_that_cannot_be_is_refused_unless_the_board_flags_a_mismatch(skin, record):
    wire, widths = Wire(skin), Widths(skin.sheet)
    assert protocol.decode(wire.plain_zones([GOOD[skin]]), widths)
    with pytest.raises(PacketError) as caught:
        protocol.decode(wire.plain_zones([record]), widths)
    assert caught.value.reason == "content"
    frame = frame_in(wire.zones([record], flags=["mismatch"]), skin)
    assert frame.extents.tolist() == [list(record[-4:])]
    assert len(Zones(frame, skin.sheet)[0].box_mm) == 4
