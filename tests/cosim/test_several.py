"""Several sheets at one FPGA do what the golden model predicts, cycle for cycle, and share one line without loss."""

import contextlib
import itertools
import random

import bench_several
import numpy as np
import pytest
from amaranth.hdl import Module
from amaranth.lib import wiring
from amaranth.lib.wiring import Out
from amaranth.sim import Simulator
from slow_skin import SHEETS, two_sheets

import contactfpga
from contactfpga import Skin, examples
from contactfpga.driver.conversation import Conversation
from contactfpga.driver.sheets import Sorter
from contactfpga.skin.several import Several
from contactfpga_hdl import several as gateware
from contactfpga_hdl.several import RoundRobin
from contactfpga_hdl.top import _SHARED_LINE
from contactfpga_sim.model.board.compiled import CompiledSheets
from contactfpga_sim.model.golden import Timeline
from contactfpga_sim.model.golden.predict import predict_several
from contactfpga_sim.model.golden.request import request
from contactfpga_sim.model.golden.trace import Cuts
from contactfpga_sim.verify.cosim.compare import Mismatch, compare
from contactfpga_sim.verify.cosim.covering import CHOICES, pairwise, skin_for

REGISTERS = {"row_drive": "74hc595", "column_read": "74hc165"}
FAST = REGISTERS | {"clock_hz": 24_000_000, "baud": 12_000_000}  # requests come as pulses
SMALL = Several(
    (
        Skin(rows=2, columns=3, settle_us=4.0, labeller="single", name="one", **FAST),
        Skin(rows=3, columns=2, settle_us=3.0, report="cells", diodes="row2col", row_order=(2, 0, 1), **FAST),
    )
)
SAFE = REGISTERS | {"clock_hz": 1_000_000, "baud": 500_000, "guard": True, "alive": True, "fail_safe": True}
GUARDED = Several(
    (
        Skin(rows=2, columns=3, settle_us=40.0, labeller="single", mask=((1, 0), (1, 1), (1, 2)), **SAFE),
        Skin(
            rows=3,
            columns=2,
            settle_us=30.0,
            report="cells",
            diodes="row2col",
            column_chains=2,
            send="on_change",
            **SAFE,
        ),
        Skin(rows=2, columns=2, settle_us=30.0, send="on_change", column_order=(1, 0), **SAFE | {"guard": False}),
    )
)
EXAMPLE = examples() / "two-sheets.toml"


def timelines(several, cycles, seed=0, received=()):
    """Random cells, stuck columns and, with guard lines, cut ones that come and go."""
    rng = np.random.default_rng(seed)
    found = []
    for skin in several.skins:
        starts = np.cumsum(rng.integers(50, 700, size=cycles // 300))
        whole = cycles // 2 if skin.guard else 0  # a report lasts to the next 65 ms
        pieces = [
            (
                int(start),
                rng.random((skin.rows, skin.columns)) < rng.choice([0.1, 0.5]),
                rng.random(skin.columns) < 0.3 if rng.random() < 0.2 and start >= whole else None,
            )
            for start in starts
        ]
        cuts = [(int(start), rng.choice(CUTS)(skin)) for start in starts[::4] if start >= whole] if skin.guard else []
        found.append(Timeline(pieces, received, cuts))
    return found


def unplugged(skin):
    return Cuts(dict.fromkeys(range(skin.row_lines), 0))


CUTS = (lambda skin: Cuts(), unplugged, lambda skin: Cuts({1: 1}, {0: 2}), lambda skin: Cuts({skin.rows: 1}))


def asked(cycles, sheets, bit_clocks, seed=0):
    """Requests of each sheet, of one that is not there and of none, with the cycle at which they begin."""
    rng = random.Random(seed)
    sent, cycle, number = [], 600, 129 * 128 + 1
    while True:
        of = rng.choice([*range(sheets), sheets, None])
        closing = b"" if of is None else bytes([2, 0xB0 + of])
        data = request(number, rng.random() < 0.2, bit_clocks, closing)
        if cycle + 10 * bit_clocks * len(data) >= cycles:
            return sent
        sent.append((cycle, data))
        cycle += 10 * bit_clocks * len(data) + rng.choice([0, 1, 300])
        number += 2 if number % 8 == 7 else 1


def heard(traces):
    """Results of the driver for the bytes on the line: conversations by sheet."""
    line = bytes(value for _, value in sorted(itertools.chain(*(trace.bytes for trace in traces))))
    sorter, found = Sorter(), [Conversation(f"sheet {number}") for number in range(len(traces))]
    for number, packet in sorter.take(line):
        assert number is not None
        found[number].receive(packet, 0.0)
    return found


def check(several, lines, cycles, limit_s=60.0):
    got = bench_several.run(several, lines, cycles, limit_s)
    want = predict_several(several.skins, lines, cycles)
    for one, other in zip(want, got, strict=True):
        assert compare(one, other) > 20
    return want


def test_gateware_and_model_agree_cycle_for_cycle():
    check(SMALL, timelines(SMALL, 2_400, received=asked(2_400, 2, 2)), 2_400)


def test_guard_lines_alive_and_fail_safe_of_each_sheet():
    """Fault reports on the shared line, and the pins `alive` and `contact`, are the golden model's in each clock."""
    want = check(GUARDED, timelines(GUARDED, 12_000, 6, [(6_000, request(9, True, 2, b"\x02\xb1"))]), 12_000)
    for skin, trace, talk in zip(GUARDED.skins, want, heard(want), strict=True):
        assert len(trace.alive) >= (3 if skin.guard else 6)
        assert talk.stats.damaged.total() == 0
        assert talk.stats.fault_reports >= 2 * skin.guard


def test_a_sheet_that_is_pulled_off_raises_contact_in_a_slot_and_stops_its_alive(rng):
    """`alive` of the others goes on. Each row is checked in its slot."""
    derived = GUARDED.skins[1].derived
    for _ in range(5):
        pulled = 4_000 + rng.randrange(derived.frame_clocks)
        lines = [
            Timeline([], cuts=[(pulled, unplugged(skin))] if skin.guard and skin.rows == 3 else [])
            for skin in GUARDED.skins
        ]
        first, second, third = predict_several(GUARDED.skins, lines, 9_000)
        ((at, level),) = first.contact
        assert level
        assert 0 < at - pulled <= derived.row_clocks + derived.column_shift_clocks + 5
        assert 3 <= len(second.alive) <= 4
        assert second.alive[-1][0] <= at
        assert len(first.alive) == len(third.alive) == 8


def test_each_of_sixteen_sheets_raises_contact_and_keeps_its_grant(monkeypatch):
    """Sheets with nothing behind their ports at the shared line."""

    class Sheet(wiring.Component):
        def __init__(self, skin, probes, place):
            super().__init__({**_SHARED_LINE, "contact": Out(1)})

        def elaborate(self, platform):
            return Module()

    monkeypatch.setattr(gateware, "Top", Sheet)
    top = gateware.SeveralTop(Several(SMALL.skins * 8))

    async def bench(ctx):
        for sheet in top.sheets:
            ctx.set(sheet.contact, 1)
            ctx.set(sheet.holds, 1)
            await ctx.tick().repeat(20)
            assert ctx.get(top.contact)
            assert [other is sheet for other in top.sheets] == [ctx.get(other.grant) for other in top.sheets]
            ctx.set(sheet.contact, 0)
            ctx.set(sheet.holds, 0)
            await ctx.tick()
            assert not ctx.get(top.contact)

    simulator = Simulator(top)
    simulator.add_clock(1e-6)
    simulator.add_testbench(bench)
    simulator.run()


def test_a_fault_of_the_grants_is_seen(monkeypatch):
    right = RoundRobin.elaborate

    def wrong(grants, platform):
        m = right(grants, platform)
        m.d.comb += grants.grant.eq(2)  # always the second sheet's
        return m

    monkeypatch.setattr(RoundRobin, "elaborate", wrong)
    with pytest.raises(Mismatch):
        check(SMALL, timelines(SMALL, 300), 300)


def test_a_sheet_waits_for_one_packet_of_each_other_one():
    """Three sheets nearly always have a packet to send, one of them long ones: each waits for at most one packet of
    each other. A sheet misses its turn if its next frame is just taking the place of the one that waited."""
    big = Skin(rows=16, columns=16, report="cells", settle_us=5.0, **REGISTERS)
    skins = [skin.replace(clock_hz=12_000_000, baud=1_000_000) for skin in (*SMALL.skins, big)]
    several = Several(tuple(skins))
    traces = predict_several(skins, timelines(several, 120_000), 120_000)
    ends = sorted((cycle, number) for number, trace in enumerate(traces) for cycle, value in trace.bytes if value == 0)
    order = [number for _, number in ends]
    assert order[:6] == [0, 0, 1, 1, 2, 2]  # a hello has a delimiter at either end
    turns = order[6:]
    assert len(turns) > 25
    assert all(one != other for one, other in itertools.pairwise(turns))
    missed = sum(before == after for before, after in zip(turns, turns[2:], strict=False))
    assert missed <= len(turns) // 6
    for talk in heard(traces):
        assert talk.stats.overwritten > 0
        assert talk.stats.damaged.total() == talk.stats.lost == 0


@pytest.mark.slow
def test_the_compiled_board_agrees_at_the_pins():
    cycles, several = 60_000, Several.load(EXAMPLE)
    sent = asked(cycles, 2, 4)
    lines = [Timeline([(at, cells, None) for at, cells, _ in line.pieces], sent) for line in timelines(several, cycles)]
    pressed = [(at, number, cells) for number, line in enumerate(lines) for at, cells, _ in line.pieces if at < cycles]
    with CompiledSheets(several) as board:
        for at, number, what in sorted([*pressed, *((at, None, data) for at, data in sent)], key=lambda one: one[0]):
            board.run(at - board.cycle)
            board.send(what) if number is None else board.press(number, what)
        board.run(cycles - board.cycle)
        want = predict_several(several.skins, lines, cycles)
        for boundary in ("line", "contact"):
            events = board.take(boundary)
            assert list(zip(events["cycle"].tolist(), events["data"].tolist(), strict=True)) == want[0].events(boundary)
    for number, talk in enumerate(heard(want)):
        assert talk.hello.place == (number, 2)
        assert talk.stats.hellos > 1  # asked for
        assert talk.stats.frames >= 5
        assert talk.stats.damaged.total() == talk.stats.lost == 0


@pytest.mark.slow
def test_the_virtual_board_serves_both_sheets(tmp_path):
    port, skins = f"sim://?sheets={two_sheets(tmp_path)}&scene=full", SHEETS
    with contextlib.ExitStack() as stack:
        boards = [stack.enter_context(contactfpga.open(f"{port}#{number}")) for number in range(len(skins))]
        assert [board.skin for board in boards] == list(skins)
        for _ in range(20):
            for board in boards:
                before = board.clock()
                assert len(board.read()) == 1
                assert board.clock() - before < 0.01
        for board in boards:
            assert board.stats.damaged.total() == board.stats.lost == 0
    with pytest.raises(contactfpga.OnlyNoise, match=r"serves several sheets; open one of them: .*#0"):
        contactfpga.open(port, timeout=0.01)


@pytest.mark.campaign
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("seed", range(30))
def test_sheets_of_all_kinds_agree(seed):
    rng = random.Random(seed)
    kinds = [choice for choice in pairwise(CHOICES, seed) if choice["row_chains"] and choice["column_chains"]]
    first = rng.choice(kinds)
    same = [first, *rng.choices(kinds, k=rng.randrange(1, 4))]
    skins = [skin_for(choice | {"link": first["link"]}) for choice in same]
    several = Several(tuple(skins))
    bit_clocks = round(skins[0].clock_hz / skins[0].baud)
    lines = timelines(several, 6_000, seed, asked(6_000, len(skins), bit_clocks, seed))
    check(several, lines, 6_000, limit_s=600.0)


def test_requests_are_for_one_sheet():
    for closing, hellos in ((b"", [1, 1]), (b"\x02\xb0", [2, 1]), (b"\x02\xb1", [1, 2]), (b"\x02\xb2", [1, 1])):
        received = [(4_000, request(9, True, 2, closing))]
        traces = predict_several(SMALL.skins, timelines(SMALL, 9_000, received=received), 9_000)
        assert [talk.stats.hellos for talk in heard(traces)] == hellos
