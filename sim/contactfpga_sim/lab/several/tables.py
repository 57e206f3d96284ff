"""Cost of several sheets on one FPGA, and their shares of the line."""

from __future__ import annotations

import functools
import itertools

import numpy as np

from contactfpga.skin import Skin
from contactfpga.skin.several import MOST_SHEETS, Several
from contactfpga.wire.faults import KIND_FAULTS, digits_of, fault_bits
from contactfpga.wire.protocol import encode_hello
from contactfpga.wire.sheet_number import NUMBER_BYTES, SheetPlace
from contactfpga_hdl.board import sizes
from contactfpga_hdl.several import SeveralTop
from contactfpga_hdl.top import Top
from contactfpga_sim.apps import size
from contactfpga_sim.lab import writer
from contactfpga_sim.model.golden import Timeline, predict
from contactfpga_sim.model.golden.predict import predict_several
from contactfpga_sim.model.golden.trace import Cuts, Trace
from contactfpga_sim.model.scenes.scene import scene

SKIN = Skin(row_drive="74hc595", column_read="74hc165")
COUNTS = (1, 2, 4, 8)
BAUDS = (3_000_000, 12_000_000)
SECONDS = 0.05


def size_table() -> str:
    cores = {1: functools.partial(Top, SKIN)} | {
        count: functools.partial(SeveralTop, Several((SKIN,) * count)) for count in (2, 3)
    }
    counts = {count: size.luts(core, sizes.UP5K) for count, core in cores.items()}
    rows = [(str(count), f"{luts:,}", f"{luts / counts[1]:.2f}") for count, luts in counts.items()]
    return writer.table_of([("sheets of 16x16", "LUT4 of 5,280", "times one sheet"), *rows])


def line_table() -> str:
    rows = [_row(count, baud) for baud in BAUDS for count in COUNTS]
    return writer.table_of([("baud", "sheets", "frames/s per sheet", "replaced", "longest wait for the line"), *rows])


def _row(count: int, baud: int) -> tuple[str, ...]:
    skin = SKIN.replace(baud=baud, clock_hz=24_000_000 if baud > 6_000_000 else SKIN.clock_hz)
    cycles = round(SECONDS * skin.clock_hz)
    timeline = Timeline([(0, np.asarray(scene(skin, "two_fingers")(0.0)), None)])
    traces = [predict(skin, timeline, cycles)]
    if count > 1:
        traces = predict_several([skin] * count, [timeline] * count, cycles)
    after = max(cycle for trace in traces for cycle, value in trace.bytes[:200] if value == 0 and cycle < cycles // 5)
    packed = sum(last and cycle > after for cycle, _, last in traces[0].rows)
    frames = [_frames(trace, after) for trace in traces]
    per_second = np.mean([len(of_one) for of_one in frames]) / (cycles - after) * skin.clock_hz
    waits = [_longest_wait(trace, of_one) for trace, of_one in zip(traces, frames, strict=True)]
    replaced = max(0.0, 1 - float(np.mean([len(of_one) for of_one in frames])) / packed)
    longest = max(waits) / skin.clock_hz * 1e6
    return f"{baud:,}", str(count), f"{per_second:,.0f}", f"{100 * replaced:.0f} %", f"{longest:.0f} µs"


def _frames(trace: Trace, after: int) -> list[int]:
    ends = [cycle for cycle, value in trace.bytes if value == 0]
    begins = {end: cycle for (end, _), (cycle, _) in itertools.pairwise(trace.bytes)}
    return [begins[end] for end in ends[:-1] if end > after]


def _longest_wait(trace: Trace, begins: list[int]) -> int:
    rows = np.array([cycle for cycle, _, last in trace.rows if last])
    newest = np.searchsorted(rows, np.array(begins)) - 1
    return int(max(np.array(begins) - rows[newest]))


def told_table() -> str:
    rows = [_told(count, baud) for baud in BAUDS for count in COUNTS[1:]]
    head = ("baud", "sheets", "board knows", "host is told", "simulated, two fingertips", "simulated, 64 zones")
    return writer.table_of([head, *rows])


def _told(count: int, baud: int) -> tuple[str, ...]:
    """Bounds, and the latest of 16 sheets; each is pulled off once in a run."""
    skin = SKIN.replace(baud=baud, clock_hz=24_000_000 if baud > 6_000_000 else SKIN.clock_hz, guard=True)
    several = Several((skin,) * count)
    zones = np.zeros((skin.rows, skin.columns), bool)
    zones[::2, ::2] = True
    latest = [_latest(several, cells) for cells in (np.asarray(scene(skin, "two_fingers")(0.0)), zones)]
    clocks = (known_clocks(skin), told_clocks(several, 0), *latest)
    return f"{baud:,}", str(count), *(f"{one / skin.clock_hz * 1e6:,.0f} µs" for one in clocks)


def _latest(several: Several, cells: np.ndarray) -> int:
    skin, count, rng = several.skins[0], len(several.skins), np.random.default_rng(len(several.skins))
    away, found = Cuts(dict.fromkeys(range(skin.row_lines), 0)), []
    for _ in range(16 // count):
        starts = rng.integers(round(0.004 * skin.clock_hz), round(0.012 * skin.clock_hz), size=count)
        lines = [Timeline([(0, cells, None)], cuts=[(int(start), away)]) for start in starts]
        traces = predict_several(several.skins, lines, round(0.012 * skin.clock_hz) + told_clocks(several, 0))
        found += [_reported(trace, start) - start for trace, start in zip(traces, starts, strict=True)]
    return int(max(found))


def _reported(trace: Trace, pulled: int) -> int:
    """First cycle after the first report of a fault."""
    packet: list[int] = []
    for cycle, value in trace.bytes:
        if value:
            packet.append(value)
            continue
        if cycle > pulled and packet[-6:-5] == [KIND_FAULTS << 4] and set(packet[1:-6]) != {0x80}:
            return cycle + trace.bytes[1][0] - trace.bytes[0][0]
        packet = []
    raise AssertionError("no report came")


def known_clocks(skin: Skin) -> int:
    """Most clocks from pulling a sheet off until its fault is known: a slot, and a sample's way to the checks."""
    return skin.derived.row_clocks + skin.derived.column_shift_clocks + 3


def told_clocks(several: Several, number: int) -> int:
    """Most clocks from pulling a sheet off until its report is received, unless the host asks for hellos.

    From the clock in which the fault is known, the report's digits are compared. The sheet may just have taken a
    packet, and another one goes before the report; before and after that one each other sheet may send a packet.
    """
    skin = several.skins[number]
    report = 6 + digits_of(fault_bits(skin.rows, skin.columns, skin.guard, skin.self_test)) + NUMBER_BYTES
    packets = [_longest(one, place) for place, one in enumerate(several.skins)]
    on_the_line = 2 * sum(packets) + report
    return known_clocks(skin) + 2 * (report + 2) + on_the_line * 10 * skin.derived.bit_clocks


def _longest(skin: Skin, number: int) -> int:
    """Bytes of a sheet's longest packet."""
    hello = encode_hello(skin, place=SheetPlace(number, MOST_SHEETS))
    return max(len(hello), skin.derived.max_frame_bytes) + NUMBER_BYTES


def line_sample() -> str:
    return writer.line(_row(COUNTS[0], BAUDS[0]))


def told_sample() -> str:
    return writer.line(_told(COUNTS[1], BAUDS[0]))
