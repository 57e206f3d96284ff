"""The golden model of the whole chain: rules of docs/timing.md worked by hand, and packets read back."""

import re
from pathlib import Path

import numpy as np
import pytest
from cobs import cobs
from reversal import small
from zone_oracles import nearest, zones_by_image_tools, zones_by_scipy

from contactfpga.choices import labellers
from contactfpga.skin import Skin
from contactfpga.skin.derived import Widths
from contactfpga.wire import protocol
from contactfpga_sim.model import golden
from contactfpga_sim.model.golden import Timeline, predict
from contactfpga_sim.model.golden.facts import facts
from contactfpga_sim.model.golden.packet import stuff
from contactfpga_sim.model.golden.uart import Byte, line, received
from contactfpga_sim.verify.cosim.covering import CHOICES, pairwise, skin_for, stimulus

SCAN = 16 * 72  # reference Skin: 60 clocks settle, 12 release
FRESH = np.zeros((16, 16), bool)


def cells_at(*places: tuple[int, int], shape: tuple[int, int] = (16, 16)) -> np.ndarray:
    cells = np.zeros(shape, bool)
    for place in places:
        cells[place] = True
    return cells


def packets(skin: Skin, trace: golden.Trace) -> list[tuple[int, bytes]]:
    """(cycle of the first byte, unsealed packet) of every whole packet in a trace."""
    found, begun, data = [], None, bytearray()
    for cycle, value in trace.bytes:
        begun = cycle if data in (b"", b"\0") else begun  # a second delimiter, or the one in front of a hello
        data.append(value)
        if value == protocol.DELIMITER and len(data) > 1:
            found.append((begun, protocol.unseal(bytes(data[:-1]).lstrip(b"\0"), protocol.check_prefix(skin))))
            begun, data = None, bytearray()
    return found


def sent_frames(skin: Skin, trace: golden.Trace) -> list[protocol.Frame]:
    plain = [packet for _, packet in packets(skin, trace) if protocol.kind_of(packet) != protocol.KIND_HELLO]
    return [protocol.decode_frame(packet, skin.derived) for packet in plain]


def test_rows_records_and_contact_of_the_reference_skin_by_hand():
    skin = Skin()
    frames = [cells_at((0, 0), (15, 3)), FRESH]
    trace = predict(skin, Timeline.frames(skin, frames), 2 * SCAN)
    # row slot k: sampled at the pins in 72 k + 59, strobe 72 k + 61, handed over at 72 k + 62
    assert trace.rows[:2] == [(62, 1, False), (134, 0, False)]
    assert trace.rows[15] == (62 + 15 * 72, 8, True)
    # a cell of row 0 is one cluster of row 1's strip: h + 1 + 3; one of the last row goes with it: h + 1 + 3
    one = 1 | 0 << 9 | 0 << 9 + 11
    other = 1 | 3 << 9 | 15 << 9 + 11
    assert trace.records[:3] == [(138, one, False), (1146, other, False), (1147, 0, True)]
    # no step in an empty frame: end mark at h + 3
    assert trace.records[3:] == [(SCAN + 1145, 0, True)]
    assert trace.contact == [(62, 1), (SCAN + 62 + 15 * 72, 0)]


def test_bytes_and_line_of_the_reference_skin_by_hand():
    skin = Skin()
    trace = predict(skin, Timeline.frames(skin, [FRESH]), 6 * SCAN)
    hello = protocol.encode_hello(skin)
    assert trace.bytes[: len(hello)] == [(2 + 40 * place, value) for place, value in enumerate(hello)]
    assert trace.line[0] == (3, 0)
    # The empty frame's end mark is put in at 1145 and packed at 1147, so it waits long before the hello ends:
    # it is replaced by the second scan's. That is taken one cycle after the delimiter, and goes when the UART is free.
    delimiter = 2 + 40 * (len(hello) - 1)
    assert trace.bytes[len(hello)][0] == delimiter + 40
    (begun, plain), *_ = packets(skin, trace)[1:]
    frame = protocol.decode_frame(plain, skin.derived)
    assert (begun, frame.sequence, frame.time_us, frame.cells, frame.zones) == (
        delimiter + 40,
        0,
        (SCAN + 61) // 12,
        0,
        0,
    )


def test_last_byte_of_a_one_zone_frame_keeps_the_stated_bound():
    """A switch that closes right after its row was sampled: two scans, the wire, and 3 us."""
    skin = Skin()
    for row in (0, 7, 15):
        closes = 40 * SCAN + row * 72 + 60
        trace = predict(skin, Timeline([(closes, cells_at((row, 5)), None)]), 44 * SCAN)
        ends = [cycle for cycle, value in trace.bytes if value == 0]
        with_zone = [frame.zones for frame in sent_frames(skin, trace)].index(1)
        wire = 40 * 18  # 14 bytes per frame, 4 per zone
        last_byte_out = ends[2 + with_zone] + 40  # after both delimiters of the hello
        assert SCAN < last_byte_out - closes <= 2 * SCAN + wire + 3 * 12


@pytest.mark.parametrize(
    "plain",
    [b"", b"\0", b"\0\0", b"\1", b"\1\0", b"\0\1", b"\1" * 253, b"\1" * 254, b"\1" * 255, b"\1" * 508, b"\1" * 509]
    + [b"\1" * 254 + b"\0", b"\1" * 254 + b"\0\1", b"\0" + b"\1" * 254, b"\1" * 253 + b"\0" + b"\2" * 254],
)
def test_stuffing_agrees_with_the_cobs_package_and_the_driver(plain):
    assert stuff(plain) == cobs.encode(plain) == protocol.cobs_encode(plain)
    assert protocol.cobs_decode(stuff(plain)) == plain


def test_serial_line_by_hand():
    assert line([(10, 0x0F)], 4) == [(11, 0), (15, 1), (31, 0), (47, 1)]
    assert line([(0, 0xFF), (40, 0xFF)], 4) == [(1, 0), (5, 1), (41, 0), (45, 1)]
    assert received([(100, b"ab")], 4) == [Byte(97, 108, 100 + 2 + 2 + 36), Byte(98, 148, 100 + 2 + 2 + 76)]
    with pytest.raises(ValueError, match="take until 140"):
        received([(100, b"a"), (139, b"b")], 4)


@pytest.mark.parametrize("wants_hello", [False, True])
def test_frames_from_the_next_sample_on_tell_a_request_and_a_hello_repeats_its_number(wants_hello):
    skin = Skin()
    start, number = 10 * SCAN, 0x12345
    trace = predict(skin, Timeline([], [(start, golden.request(number, wants_hello))]), 26 * SCAN)
    numbers = {frame.time_us: frame.heard for frame in sent_frames(skin, trace)}
    came = start + 9 * 40 + 2 + 2 + 36
    assert numbers == {time_us: number % 8 * (12 * time_us > came) for time_us in numbers}
    assert set(numbers.values()) == {0, number % 8}
    hellos = [(cycle, plain) for cycle, plain in packets(skin, trace) if plain[-1] >> 4 == protocol.KIND_HELLO]
    assert len(hellos) == 1 + wants_hello
    for cycle, plain in hellos:
        assert protocol.HelloReader().take(plain).heard == number * (cycle > came)


def test_frames_that_are_overwritten_take_no_request_with_them():
    skin = Skin(baud=100_000)  # a frame takes 16 scans on the wire
    start = 150 * SCAN
    trace = predict(skin, Timeline([], [(start, golden.request(0x12345))]), 300 * SCAN)
    frames = sent_frames(skin, trace)
    assert [frame.sequence for frame in frames] == list(range(len(frames)))
    came = start + 9 * 1200 + 2 + 60 + 9 * 120
    assert [frame.heard for frame in frames] == [5 * (12 * frame.time_us > came) for frame in frames]
    assert {frame.heard for frame in frames} == {0, 5}


def test_unchanged_frames_are_kept_back_until_the_keep_alive():
    skin = Skin(send="on_change", keep_alive_ms=1.0)  # ten scans of 96 us
    frames = [FRESH] * 15 + [cells_at((3, 3))] * 12
    trace = predict(skin, Timeline.frames(skin, frames), 27 * SCAN)
    indices = [frame.time_us // 96 for frame in sent_frames(skin, trace)]
    assert indices == [0, 10, 15, 25]


def test_overflow_carries_what_fits_and_counts_all():
    skin = Skin(rows=3, columns=5, zone_capacity=2)
    cells = cells_at((0, 0), (0, 2), (0, 4), (2, 0), shape=(3, 5))
    trace = predict(skin, Timeline.frames(skin, [cells] * 40), 40 * 3 * 72)
    frame = sent_frames(skin, trace)[-1]
    assert (frame.flags, frame.zones, frame.cells) == ({"overflow"}, 4, 4)
    assert frame.moments.tolist() == [[1, 0, 0], [1, 2, 0]]


def test_stuck_columns_read_pressed_and_are_counted_once():
    skin = Skin(rows=2, columns=4, mask=((0, 1), (0, 3), (1, 3)))
    stuck = np.array([True, True, False, True])
    cells = np.zeros((2, 4), bool)
    trace = predict(skin, Timeline.frames(skin, [cells] * 60, [stuck] * 60), 60 * 2 * 72)
    assert [event[1:] for event in trace.rows[:2]] == [(0b0001, False), (0b0011, True)]
    assert {frame.flags for frame in sent_frames(skin, trace)[1:]} == {frozenset({"fault"})}


@pytest.mark.parametrize("choice", pairwise(CHOICES), ids=lambda choice: "x".join(map(str, choice["sheet"])))
def test_packets_read_back_by_the_driver_hold_what_was_scanned(choice):
    skin = skin_for(choice)
    known = facts(skin)
    cycles = max(30 * known.scan_clocks, 20_000, 4000 * known.bit_clocks)
    timeline = stimulus(skin, cycles, seed=1)
    trace = predict(skin, timeline, cycles)
    rows = np.array([[word >> column & 1 for column in range(skin.columns)] for _, word, _ in trace.rows], bool)
    strobe = known.first_slot + known.settle + 1 + known.column_shift
    late = strobe + 1 + (skin.columns + 3 if known.debounced else 0)
    seen = 0
    for begun, plain in packets(skin, trace):
        if protocol.kind_of(plain) == protocol.KIND_HELLO:
            assert protocol.HelloReader().take(plain).sheet == skin.sheet
            continue
        frame = protocol.decode_frame(plain, skin.derived)
        scans = [  # a few, where a scan takes less than a microsecond
            number
            for number in range(len(rows) // skin.rows)
            if (number * known.scan_clocks + strobe - known.column_shift) // known.clocks_per_us == frame.time_us
            and trace.rows[number * skin.rows][0] == number * known.scan_clocks + late < begun
        ]
        assert any(holds(skin, frame, rows[scan * skin.rows : (scan + 1) * skin.rows]) for scan in scans)
        assert "mismatch" not in frame.flags
        seen += 1
    assert seen


def holds(skin: Skin, frame: protocol.Frame, cells: np.ndarray) -> bool:
    """Whether a frame tells of these cells what it should."""
    if skin.report == "cells":
        return np.array_equal(frame.bitmap, cells)
    exact = labellers.find(skin.labeller).exact
    zones = golden.zones(cells, skin.connectivity) if exact else sorted(zones_by_image_tools(cells, skin.labeller))
    records = frame.moments
    if skin.report == "barycenter":
        records, zones = frame.barycenters, sorted(rounded(zone, skin.barycenter_bits) for zone in zones)
    carried = sorted(map(tuple, records.tolist()))
    if (frame.cells, frame.zones) != (cells.sum(), len(zones)):
        return False
    if "overflow" in frame.flags:
        return len(zones) > len(carried) == skin.zone_capacity and set(carried) <= set(zones)
    return carried == zones


def rounded(zone: tuple[int, int, int], bits: int) -> tuple[int, int, int]:
    """Area, and both sums over it, to the nearest step of 1/2^bits, half a step upward."""
    area, sum_x, sum_y = zone
    return area, nearest(sum_x, area, bits), nearest(sum_y, area, bits)


def test_widths_of_barycenters_agree_with_the_gatewares_table_for_every_sheet():
    for rows in range(1, 65):
        for columns in (1, 2, 3, rows, 31, 64):
            for bits in (0, 4, 8):
                skin = Skin(rows=rows, columns=columns, report="barycenter", barycenter_bits=bits, settle_us=500.0)
                mine, theirs = facts(skin), skin.derived
                assert mine.barycenter_bits == theirs.record_bits, (rows, columns, bits)
                assert (mine.division, mine.item_bytes) == (theirs.quotient_bits, theirs.item_bytes)


def test_widths_agree_with_the_gatewares_table_for_every_sheet():
    for rows in range(1, 65):
        for columns in (1, 2, 3, rows, 31, 64):
            for connectivity in (4, 8):
                skin = Skin(rows=rows, columns=columns, connectivity=connectivity, settle_us=500.0)
                mine, theirs = facts(skin), skin.derived
                for name in ("area_bits", "sum_x_bits", "sum_y_bits", "zones_bits", "item_bytes"):
                    assert getattr(mine, name) == getattr(theirs, name), (rows, columns, connectivity, name)


@pytest.mark.parametrize("megahertz", [1, 12, 50])
def test_clocks_agree_with_the_gatewares_table_where_decimals_are_not_exact(megahertz):
    for rows, row_clocks in ((1, 143), (3, 59), (11, 45), (16, 72)):
        scan_us = rows * row_clocks / megahertz
        for scans in range(1, 12):
            skin = Skin(
                rows=rows,
                columns=5,
                clock_hz=megahertz * 1_000_000,
                baud=250_000,
                settle_us=(row_clocks - 4) / megahertz,
                release_us=4 / megahertz,
                debounce="sym_defer_pk",
                debounce_press_us=scans * scan_us,
                debounce_release_us=(scans + 0.5) * scan_us,
                send="on_change",
                keep_alive_ms=scans * scan_us / 1000,
            )
            mine, theirs = facts(skin), skin.derived
            assert mine.scan_clocks == theirs.frame_clocks == rows * row_clocks
            assert (mine.press_scans, mine.release_scans) == (theirs.press_scans, theirs.release_scans)
            assert (mine.press_scans, mine.release_scans) == (scans, scans + 1)
            assert mine.keep_alive_scans == theirs.keep_alive_frames == scans, skin.keep_alive_ms
            assert mine.hello_scans == theirs.hello_frames


def test_golden_model_runs_without_amaranth(python):
    code = "import sys, contactfpga_sim.model.golden; print(*sys.modules)"
    loaded = python(code).stdout.split()
    assert "contactfpga_sim.model.golden" in loaded
    assert not [name for name in loaded if name.split(".")[0] in ("amaranth", "contactfpga_hdl")]


def test_the_golden_model_asks_a_skin_for_nothing_derived():
    """It computes widths and times itself; the linter sees imports alone."""
    folder = Path(golden.__file__).parent
    assert [path.name for path in folder.rglob("*.py") if re.search(r"\bderived\b", path.read_text())] == []


@pytest.mark.parametrize("labeller", labellers.LABELLERS)
@pytest.mark.parametrize("rows", [(0,), (3,), (0, 3), (1, 5), (0, 1, 4, 5)])
def test_moments_of_zones_in_rows_that_were_driven_count_the_rows_between(labeller, rows):
    skin = small(rows=6, columns=3, labeller=labeller)
    cells = np.zeros((6, 3), bool)
    cells[list(rows), 1] = True
    widths = Widths(skin.sheet)
    records = [data for _, data, end in predict(skin, Timeline([(0, cells, None)]), 400).records if not end]
    low = widths.area_bits + widths.sum_x_bits
    found = sorted((data & (1 << widths.area_bits) - 1, data >> low) for data in set(records))
    if labeller == "single":
        assert found == [(len(rows), sum(rows))]
    else:
        assert found == sorted((area, sum_y) for area, _, sum_y in zones_by_scipy(cells))
