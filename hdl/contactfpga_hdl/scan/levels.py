"""Levels of force: several samples of a row, of which each is a threshold."""

from typing import Any

from amaranth.hdl import Cat, Module, Signal, Value
from amaranth.lib import wiring

from contactfpga_hdl.scan.ruler import Ruler
from contactfpga_hdl.util.bits import popcount


def count_levels(m: Module, scanner: wiring.Component, slots: Any, columns: Value, sample: Any) -> Value:
    """The level of each column, as in a row's ``cells``: in how many samples it read pressed.

    ``columns``: levels of the column pins, two clocks late. ``sample``, a raster scan's, reads the
    lightest level. Each harder level has a sample and a ruler of its own; the ruler is appended to ``sample.harder``.
    """
    skin, derived = scanner.skin, scanner.derived
    read = [sample.read[: skin.columns]]
    for level in range(1, skin.levels):
        ruler = Ruler(m, derived, scanner.moves, scanner.clocks, slots.begins_rows, level)
        sample.harder.append(ruler)
        now, kept = (Signal(skin.columns, name=f"{name}_{level}") for name in ("level_now", "level_kept"))
        live = columns[: skin.columns]
        sampled = Signal(name=f"sampled_{level}")  # two synchronizer stages ago
        m.d.sync += sampled.eq(slots.clock == ruler.clock)
        with m.If(sampled):
            m.d.comb += now.eq(~live if skin.selects_low else live)
        with m.Else():
            m.d.comb += now.eq(kept)
        m.d.sync += kept.eq(now)
        read.append(now)
    return Cat(Value.cast(popcount(pressed))[: derived.level_bits] for pressed in zip(*read))
