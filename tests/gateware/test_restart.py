"""After a restart a board does what one does that was never used, whatever it did before."""

from typing import ClassVar

import pytest
from amaranth.hdl import Cat, Module, ResetInserter, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out
from reversal import small

from contactfpga import Skin
from contactfpga_hdl import core
from contactfpga_hdl.dual import PAUSE_BITS, Dual
from contactfpga_hdl.top import Top

FIELDS = {
    "rows": 3, "columns": 5, "clock_hz": 1_000_000, "baud": 500_000, "settle_us": 19, "debounce_press_us": 100,
    "debounce_release_us": 300,
}  # fmt: skip
SYM, EAGER = ({"debounce": method} for method in ("sym_defer_pk", "asym_eager_defer_pk"))
BOARDS = {
    "raster": Skin(**FIELDS, **SYM, units=2, unit_sums=((1, 1),), labeller="projection"),
    "raster, guard": Skin(**FIELDS | {"rows": 4}, **EAGER, guard=True, fail_safe=True, labeller="serial"),
    "raster, cells": Skin(**FIELDS, **EAGER, report="cells", send="on_change", keep_alive_ms=5),
    "reversal": small(**EAGER, columns=9, debounce_press_us=9, debounce_release_us=30, self_test=True),
    "reversal, guard": small(**SYM, columns=9, debounce_press_us=3, debounce_release_us=30, guard=True, alive=True),
    "around": Skin(**FIELDS | {"columns": 8, "settle_us": 30}, closed=True, surface="cylinder", radius_mm=20.0,
                   labeller="serial"),
}  # fmt: skip


class Hit(core.StreamTop):
    """Restarts as if a register had flipped."""

    def __init__(self, skin: Skin):
        super().__init__(skin)
        self.hit = Signal()

    def elaborate(self, platform):
        m = super().elaborate(platform)
        with m.If(self.hit):
            m.d.sync += self._restarts.eq(1)
        return m


class Copy(Top):
    """A copy of the gateware that sends a wrong bit."""

    def __init__(self, skin: Skin):
        super().__init__(skin, copy=True)
        self.hit = Signal()

    def elaborate(self, platform):
        m = super().elaborate(platform)
        with m.If(self.hit):
            m.d.comb += self.tx.eq(~m.submodules.transmitter.pin)
        return m


VALID = {"tdata": "tvalid", "tlast": "tvalid", **dict.fromkeys(("cells", "data", "last", "end"), "transfer")}
"""Last words of the names of payloads, and of what is high while they mean something."""


class Two(wiring.Component):
    """A board that restarts in the clock after ``now``, and one that stays in reset until ``begins``."""

    KEPT: ClassVar = {"reset": (), "dual": (), "flip": ("contact", "alive", "m_axis_records_")}
    """First parts of the names of outputs that a restart of this kind does not reset."""

    def __init__(self, skin: Skin, kind: str):
        self.kind = kind
        self.late = {"reset": 1, "flip": 2, "dual": 2 + 2 * PAUSE_BITS * skin.derived.bit_clocks}[kind]
        if kind == "dual":
            self._fresh, self._hit = Top(skin, copy=True, probes=True), Copy(skin)
            self._used = Dual(skin, Top(skin, copy=True, probes=True), self._hit)
        else:
            self._fresh, self._used = core.Core(skin), core.Core(skin)
            self._hit = self._used._top
        members = self._used.signature.members
        self.inputs = {name: member for name, member in members.items() if member.flow == In}
        self.outputs = [
            name for name, one in members.items() if one.flow == Out and not name.startswith(self.KEPT[kind])
        ]
        super().__init__(
            {**self.inputs, "now": In(1), "begins": In(1), "said": Out(1), "differ": Out(len(self.outputs))}
        )

    def elaborate(self, platform):
        m = Module()
        now, waits = Signal(), Signal()
        m.submodules.used = used = ResetInserter(now)(self._used)
        m.submodules.fresh = fresh = ResetInserter(waits)(self._fresh)
        m.d.comb += [now.eq(self.now & (self.kind == "reset")), waits.eq(~self.begins)]
        m.d.comb += self._hit.hit.eq(self.now & (self.kind != "reset"))
        for name in self.inputs:
            m.d.comb += [getattr(board, name).eq(getattr(self, name)) for board in (used, fresh)]
        differ = []
        for name in self.outputs:
            boundary, _, word = name.rpartition("_")
            counts = getattr(fresh, f"{boundary}_{VALID[word]}") if word in VALID else 1
            differ.append((getattr(used, name) != getattr(fresh, name)) & counts)
        dual = self.kind == "dual"
        m.d.comb += [self.differ.eq(Cat(differ)), self.said.eq(fresh.byte_transfer if dual else fresh.m_axis_tvalid)]
        return m


def levels(rng, width: int, cycles: int, pressed: float, rests: int) -> list[int]:
    """Words of lines by cycle, each pressed (1) with this chance for up to 40 cycles, and after it for up to ``rests``
    none."""
    words: list[int] = []
    while len(words) < cycles:
        word = sum((rng.random() < pressed) << line for line in range(width))
        words += [word] * rng.randint(1, 40) + [0] * rng.randint(0, rests)
    return words[:cycles]


CASES = [
    ("raster", "reset"), ("raster, guard", "flip"), ("reversal", "flip"),
    ("raster, cells", "reset"), ("reversal, guard", "reset"),
    ("raster", "dual"), ("reversal", "dual"), ("around", "reset"),
]  # fmt: skip


@pytest.mark.parametrize(("name", "kind"), CASES)
def test_a_board_that_restarts_is_as_one_that_was_never_used(monkeypatch, bench, rng, name, kind):
    monkeypatch.setattr(core, "StreamTop", Hit)
    skin = BOARDS[name].replace(dual=kind == "dual")
    dut = Two(skin, kind)
    before, after = rng.randint(700, 900), 1500
    begins = before + dut.late
    sim = bench(dut)
    for pin in dut.inputs:
        width = len(getattr(dut, pin))
        if pin in ("columns", "rows_read"):
            words = levels(rng, width, begins, 0.4, 40) + levels(rng, width, after + 1, 0.1, 400)
            flip = (1 << width) - 1 if skin.selects_low == (pin == "columns") else 0
            words = [word ^ flip for word in words]
        else:
            words = [rng.getrandbits(width) for _ in range(begins + after + 1)]
        sim.drive(getattr(dut, pin), words.__getitem__)
    sim.drive(dut.now, lambda cycle: cycle == before)
    sim.drive(dut.begins, lambda cycle: cycle >= begins)
    differ, said = sim.watch(dut.differ), sim.watch(dut.said)
    sim.run(begins + after)
    wrong = [(cycle - begins, word) for cycle, word in enumerate(differ.values) if cycle >= begins and word]
    assert not wrong, (wrong[0], [pin for bit, pin in enumerate(dut.outputs) if wrong[0][1] >> bit & 1])
    assert sum(said.values[begins:]) > 15, "it says something"
    assert any(differ.values[:begins]), "the other one was used"
