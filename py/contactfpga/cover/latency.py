"""How long a touch takes from the switch to the last byte on the wire."""

from __future__ import annotations

from contactfpga.derived import CHECK_BYTES, Derived
from contactfpga.skin import Skin

AROUND_S = 3e-6
"""Sample, labeller, packer and stop bit, in s."""


def latency_s(skin: Skin) -> float:
    """The worst case in s for one zone: two scans, as a touch may just have missed its row, the bytes, and 3 us.

    Debounce adds the time that a press must last.
    """
    derived = Derived(skin)
    items = 1 if skin.report == "moments" else derived.max_items
    plain = items * derived.item_bytes + derived.trailer_bytes
    packet = plain + -(-plain // 254) + CHECK_BYTES + 1
    scans = 2 + (derived.press_scans if skin.debounce == "sym_defer_pk" else 0)
    clocks = scans * derived.frame_clocks + packet * 10 * derived.bit_clocks
    return clocks / skin.clock_hz + AROUND_S
