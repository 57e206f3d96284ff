"""A sheet without diodes: what may be a ghost is reported, exactly while nothing changes, and never missed."""

import collections
import itertools
import re

import numpy as np
import pytest
from sample import sample
from scipy import ndimage
from wire import Wire
from zone_oracles import moments

from contactfpga import Skin
from contactfpga.boards import BOARDS
from contactfpga.driver.conversation import Conversation, frames_in
from contactfpga.wire import protocol
from contactfpga.wire.protocol import HelloReader
from contactfpga_hdl.board.build import plan_for
from contactfpga_sim.model.golden import Timeline, predict, requests
from contactfpga_sim.model.sheet.wiring import Wiring
from contactfpga_sim.verify.cosim import bench_amaranth
from contactfpga_sim.verify.cosim.compare import compare

BARE = Wiring(bare=np.ones((1, 1), bool), floating=True)


def skin_of(rows, columns, report="moments"):
    return Skin(rows=rows, columns=columns, diodes="none", connectivity=4, report=report, settle_us=50.0)


def received(skin, *frames, **options):
    """What the host makes of these (rows, columns) bool frames, one after the other."""
    host, wire = Conversation("x"), Wire(skin)
    data = wire.hello()
    for number, cells in enumerate(frames):
        options |= {"sequence": number, "time": 96 * number}
        if skin.report == "cells":
            data += wire.cells(cells, **options)
        else:
            data += wire.zones([moments(zone) for zone in zones_of(cells)], **options)
    return frames_in(host.receive(data, 0.0))


def zones_of(cells):
    labels, count = ndimage.label(cells)
    return [labels == label for label in range(1, count + 1)]


def every_static_frame(rows, columns):
    """Each frame that a sheet can show while nothing changes, with all the pressed cells that make it look so."""
    made_by = collections.defaultdict(list)
    for number in range(1 << rows * columns):
        pressed = (number >> np.arange(rows * columns) & 1).astype(bool).reshape(rows, columns)
        made_by[BARE.read(pressed)[0].tobytes()].append(number)
    for shown, numbers in made_by.items():
        yield np.frombuffer(shown, bool).reshape(rows, columns), numbers


def number_of(cells):
    return int((cells.ravel().astype(np.int64) << np.arange(cells.size)).sum())


@pytest.mark.parametrize(
    ("rows", "columns"), sample([(3, 4), (4, 3), (1, 5), (5, 1), (2, 6)], quick=[(3, 4), (1, 5), (5, 1)])
)
def test_in_a_static_frame_exactly_what_can_be_a_ghost_is_reported(rows, columns, record_property):
    zones_skin, cells_skin = skin_of(rows, columns), skin_of(rows, columns, "cells")
    cases, flagged = 0, 0
    for shown, numbers in every_static_frame(rows, columns):
        reported = received(zones_skin, shown, shown)[1]
        ghosts = sorted(
            (moments(zone), any(not number & number_of(zone) for number in numbers)) for zone in zones_of(shown)
        )
        assert sorted(((zone.area_cells, zone.sum_x, zone.sum_y), zone.ghost) for zone in reported) == ghosts
        pairs = itertools.combinations(zones_of(shown), 2)
        spread = any((one.any(axis) & other.any(axis)).any() for one, other in pairs for axis in (0, 1))
        assert reported.flags == ({"ghost"} if spread else set())
        bitmap = received(cells_skin, shown, shown)[1]
        all_of_them = 0xFFFF
        for number in numbers:
            all_of_them &= number
        assert number_of(bitmap.ghost_cells) == number_of(shown) & ~all_of_them
        assert ("ghost" in bitmap.flags) == bitmap.ghost_cells.any()
        cases += len(numbers)
        flagged += any(ghost for _, ghost in ghosts)
    assert bool(flagged) == (rows > 2 and columns > 2)
    record_property("cases", cases)


def changing(rng, rows, columns):
    """A frame in which a switch changes between two rows, and the cells that no pressed switch stands behind."""
    before = rng.random((rows, columns)) < rng.uniform(0.05, 0.4)
    after = before ^ (rng.random((rows, columns)) < rng.choice([0.05, 0.15]))
    row = int(rng.integers(1, rows))
    shown = np.concatenate([BARE.read(before)[0][:row], BARE.read(after)[0][row:]])
    pressed = np.concatenate([before[:row], after[row:]])
    return BARE.read(before)[0], shown, shown & ~pressed


@pytest.mark.parametrize("seed", sample(range(4), quick=[0, 1]))
def test_no_ghost_is_missed_while_a_switch_changes(seed, record_property):
    rng = np.random.default_rng(seed)
    zones_skin, cells_skin = skin_of(7, 6), skin_of(7, 6, "cells")
    hidden = 0
    for _ in range(400):
        still, shown, ghosts = changing(rng, 7, 6)
        bitmap = received(cells_skin, still, shown)[1]
        assert not (ghosts & ~bitmap.ghost_cells).any()
        reported = received(zones_skin, still, shown)[1]
        suspects = {(zone.area_cells, zone.sum_x, zone.sum_y) for zone in reported if zone.ghost}
        for zone in zones_of(shown):
            if ghosts[zone].all():
                assert moments(zone) in suspects
        hidden += bool((ghosts & ~received(cells_skin, shown, shown)[1].ghost_cells).any())
    assert hidden  # without the rule for frames that change some would be missed
    record_property("cases", 400)


def test_frames_with_zones_missing_or_wrong_are_all_suspect():
    skin = skin_of(7, 6).replace(zone_capacity=1)
    host, wire = Conversation("x"), Wire(skin)
    frames = b"".join(
        wire.zones([(1, 0, 0)], zones=4, cells=4, flags=["overflow"], sequence=number, time=number) for number in (0, 1)
    )
    zones = frames_in(host.receive(wire.hello() + frames, 0.0))[-1]
    assert zones[0].ghost
    assert zones.flags == {"overflow", "ghost"}


def test_sheets_with_diodes_have_no_ghosts():
    corners = np.zeros((5, 5), bool)
    corners[np.ix_([0, 3], [1, 4])] = True
    for report in ("moments", "cells"):
        (zones,) = received(Skin(rows=5, columns=5, report=report, settle_us=20.0), corners)
        assert zones.flags == set()
        assert not any(zone.ghost for zone in zones)
        assert not zones.array["ghost"].any()
        assert zones.ghost_cells is None or not zones.ghost_cells.any()


def test_the_hello_tells_that_there_are_no_diodes():
    for skin in (skin_of(4, 5), skin_of(4, 5, "cells"), Skin(rows=4, columns=5, settle_us=20.0, diodes="row2col")):
        packet = protocol.encode_hello(skin)
        assert packet == Wire(skin).hello()
        hello = HelloReader().take(protocol.unseal(packet[1:-1], b""))
        assert hello.sheet.ghosts == (skin.diodes == "none")


def test_json_tells_ghosts():
    corners = np.zeros((5, 5), bool)
    corners[np.ix_([0, 3], [1, 4])] = True
    bitmap = received(skin_of(5, 5, "cells"), corners)[0].to_dict()
    assert bitmap["ghost_cells"] == bitmap["cells"]
    assert [zone["ghost"] for zone in received(skin_of(5, 5), corners)[0].to_dict()["zones"]] == [True] * 4


@pytest.mark.slow
def test_the_gateware_is_the_golden_models_in_every_clock(record_property):
    skin = Skin(rows=6, columns=7, diodes="none", connectivity=4)
    rng = np.random.default_rng(5)
    frames = np.array([BARE.read(cells)[0] for cells in rng.random((12, 6, 7)) < rng.uniform(0, 0.5, (12, 1, 1))])
    timeline = Timeline.frames(skin, frames, received=requests([1_500], 4))
    cycles = 12 * 6 * 72
    assert compare(predict(skin, timeline, cycles), bench_amaranth.run(skin, timeline, cycles)) > 300
    record_property("cases", cycles)


def test_rows_of_a_board_are_low_or_float():
    """A tristate output a row whose data are 0; with diodes each drives all the time."""
    skin = BOARDS["icebreaker"].skin.replace(row_drive="direct", rows=8, columns=8, connectivity=4, precharge_us=0)
    counts = []
    for diodes in ("none", "col2row"):
        netlist = plan_for(BOARDS["icebreaker"], skin.replace(diodes=diodes)).files["contactfpga.il"]
        netlist = netlist if isinstance(netlist, str) else netlist.decode()
        enables = re.findall(r"connect \\OUTPUT_ENABLE (.*)", netlist)
        counts.append((len(enables) - enables.count("1'1"), len(re.findall(r"connect \\D_OUT_0 1'0", netlist))))
    assert counts == [(8, 8), (0, 0)]


def test_pairs_of_ranges_of_one_middle_overlap():
    """What makes x and y of zones tell runs of columns and rows apart."""
    runs = [range(start, end) for start, end in itertools.combinations(range(9), 2)]
    for one, other in itertools.product(runs, repeat=2):
        if sum(one) * len(other) == sum(other) * len(one):
            assert set(one) & set(other)
