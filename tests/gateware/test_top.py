"""The whole chain: it can be built for every kind of Skin, and tells the facts of the right frame."""

import contextlib
import itertools
import math
import time

import pytest
from amaranth.back import rtlil
from amaranth.hdl import Fragment
from amaranth.sim import Simulator
from sample import sample

from contactfpga import Skin
from contactfpga_hdl.top import Top
from contactfpga_sim.verify.proofs.inside import Inside

SKINS = {
    "reference": {},
    "1x1": {"rows": 1, "columns": 1},
    "64x64, 4": {"rows": 64, "columns": 64, "settle_us": 20.0, "connectivity": 4, "debounce": "sym_defer_pk"},
    "2x1, cells": {"rows": 2, "columns": 1, "report": "cells", "send": "on_change", "keep_alive_ms": 1.0},
    "64x64, barycenter": {"rows": 64, "columns": 64, "report": "barycenter", "labeller": "serial"},
    "slow": {"rows": 5, "columns": 3, "clock_hz": 1_000_000, "baud": 9600, "settle_us": 10_000.0},
    "fast": {"clock_hz": 100_000_000, "baud": 10_000_000, "zone_capacity": 1},
    "64x64, registers": {
        "rows": 64,
        "columns": 64,
        "row_drive": "74hc595",
        "row_chains": 2,
        "column_read": "74hc165",
        "column_chains": 8,
    },
}


@pytest.mark.parametrize("name", sample(SKINS, quick=["1x1", "64x64, 4", "2x1, cells"]))
def test_it_builds_quickly(name):
    options = {"settle_us": 12.0} | SKINS[name]
    top = Top(Skin(**options))
    start = time.process_time()
    text = rtlil.convert(top)
    assert "module \\top" in text
    assert time.process_time() - start < 10


@pytest.mark.parametrize("name", ["2x1, cells"])
def test_probes_are_ports_only_when_asked_for(name):
    skin = Skin(**{"settle_us": 12.0} | SKINS[name])
    for boundary in ("row_transfer", "record_transfer", "byte_transfer"):
        assert boundary in rtlil.convert(Top(skin, probes=True))
        assert boundary not in rtlil.convert(Top(skin))


def plain(packet):
    """A packet without its check bytes and stuffing; its blocks are short."""
    packet = packet[:-3]
    out, position = b"", 0
    while position < len(packet):
        out += packet[position + 1 : position + packet[position]] + b"\0"
        position += packet[position]
    return out[:-1]


def shortest(**fields):
    """The Skin with the shortest rows it allows, and their clocks: found by trying, not by its own formula."""
    for clocks in range(10, 100):
        with contextlib.suppress(ValueError):
            return Skin(settle_us=(clocks - 1) / 12, release_us=1 / 12, **fields), clocks
    raise AssertionError("no Skin")


REPORTS, DEBOUNCES = ("moments", "barycenter", "cells"), ("none", "sym_defer_pk", "asym_eager_defer_pk")


@pytest.mark.parametrize(
    ("rows", "columns", "debounce", "report"),
    sample(
        itertools.product((2, 3), (16, 12), DEBOUNCES, REPORTS),
        quick=[(2, 16, "sym_defer_pk", "barycenter")],
    ),
)
def test_a_frame_carries_its_own_time_at_the_shortest_row_time(bench, report, debounce, rows, columns):
    """The trailer has its own frame's time, though with debounce the next frame's rows are sampled before it is
    packed."""
    skin, clocks = shortest(
        rows=rows,
        columns=columns,
        report=report,
        debounce=debounce,
        debounce_press_us=0,
        debounce_release_us=0,
        zone_capacity=1,
    )
    top = Top(skin, probes=True)
    sim = bench(top)
    sim.drive(top.columns, lambda cycle: sum(1 << x for x in range(1, columns, 2)))  # a run in every other column
    transfer, byte = sim.watch(top.byte_transfer), sim.watch(top.byte_data)
    sim.run(7500)
    data = bytes(value for taken, value in zip(transfer.values, byte.values) if taken)
    packets = [plain(packet) for packet in data.split(b"\0")[:-1] if packet]
    frames = [packet for packet in packets if packet[-1] >> 4 != 4]
    assert len(frames) > 3
    counted = 35 + (rows * columns).bit_length() + ((rows + 1) // 2 * ((columns + 1) // 2)).bit_length()
    size = math.ceil((counted + 4) / 8) + 1
    for packet in frames:
        word = int.from_bytes(packet[-size:-1], "little")
        number = (12 * (word & 0xFFFFFF) + 11) // (clocks * rows)  # of its scan, by its time
        assert word & 0xFFFFFF == (number * clocks * rows + clocks) // 12
        before = (word >> 24 & 255) + (word >> counted)  # sent, and overwritten modulo the bits of their counter
        assert (number - before) % (1 << 8 * (size - 1) - counted) == 0


WATCHED = (
    "scan.frame_clock.time", "scan.following", "scan.driver.selected", "link.filling", "link.waiting", "link.sending",
)  # fmt: skip


def test_a_register_that_turns_by_itself_starts_all_but_the_transmitter_anew():
    """Two clocks later each of their registers has the value that it has at power-up, and then ``contact`` is high with
    ``fail_safe``."""
    top = Top(Skin(rows=2, columns=3, settle_us=3.0, fail_safe=True))
    fragment = Fragment.get(top, None)
    parts = [Inside(part) for part, name, _ in fragment.subfragments if name != "transmitter"]
    registers = [one for part in parts for one in part.registers() if not one.reset_less]
    seen = {name: [] for name in WATCHED}

    async def bench(ctx):
        ctx.set(top.columns, 0b111)
        fresh = [ctx.get(one) for one in registers]
        for name in WATCHED:
            await ctx.tick().repeat(200)
            wrong = Inside(fragment)[name]
            ctx.set(wrong, ctx.get(wrong) ^ 2)
            for clocks in (2, 1, 1):
                seen[name].append(([ctx.get(one) for one in registers] == fresh, ctx.get(top.contact)))
                await ctx.tick().repeat(clocks)

    simulator = Simulator(fragment)
    simulator.add_clock(1e-6)
    simulator.add_testbench(bench)
    simulator.run()
    for (before, low), (anew, still_low), (_, high) in seen.values():
        assert (before, anew) == (False, True)
        assert (low, still_low, high) == (0, 0, 1)
