"""How long a touch takes from the switch to the last byte on the wire."""

from __future__ import annotations

from contactfpga.skin import Skin
from contactfpga.skin.derived import CHECK_BYTES, Derived

AROUND_S = 3e-6
"""Sample, labeller, packer and stop bit, in s."""


def latency_s(skin: Skin) -> float:
    """A bound in s for one zone: two scans, as a touch may just have missed its row, the bytes, and 3 us.

    An adaptive scan counts at its longest. Debounce adds the time that a press must last, the serial labeller its
    clocks after the last row, and a board that divides those of a division.
    """
    derived = Derived(skin)
    items = derived.max_items if skin.report == "cells" else 1
    plain = items * derived.item_bytes + derived.trailer_bytes
    packet = plain + -(-plain // 254) + CHECK_BYTES + 1
    clocks = 2 * derived.max_frame_slots * derived.row_clocks + packet * 10 * derived.bit_clocks
    if skin.debounce == "sym_defer_pk":
        clocks += derived.press_scans * derived.frame_clocks
    if skin.labeller == "serial":
        clocks += derived.label_clocks
    if skin.report == "barycenter":
        clocks += derived.item_clocks
    return clocks / skin.clock_hz + AROUND_S
