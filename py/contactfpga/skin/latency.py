"""Latency of a touch, from the switch to the last byte on the wire."""

from __future__ import annotations

from contactfpga.choices import debounces
from contactfpga.skin.derived import CHECK_BYTES
from contactfpga.skin.skin import Skin

AROUND_S = 3e-6
"""Time of sample, labeller, packer and stop bit in s."""


def latency_s(skin: Skin) -> float:
    """Upper bound in s on the latency of one zone: two scans, as a touch may just have missed its row, the bytes, and 3
    us.

    Frames count at their longest. Debounce adds the press time, a labeller with a cell per clock its clocks after the
    last row, and a dividing board those of a division.
    """
    derived = skin.derived
    items = 1 if derived.report.zones else derived.max_items
    plain = items * derived.item_bytes + derived.trailer_bytes
    packet = plain + -(-plain // 254) + CHECK_BYTES + 1
    clocks = 2 * derived.max_frame_clocks + packet * 10 * derived.bit_clocks
    if debounces.find(skin.debounce).delays_press:
        clocks += derived.press_scans * derived.frame_clocks
    if derived.label_empty_row_clocks > 1:
        clocks += derived.label_clocks
    if derived.report.divided:
        clocks += derived.item_clocks
    return clocks / skin.clock_hz + AROUND_S
