"""Which row of the sheet a row is."""

from amaranth.hdl import Module, Mux, Signal, Value
from amaranth.lib import data

from contactfpga.skin.derived import Derived


def row_number(m: Module, derived: Derived, row: data.View, taken: Value) -> Value:
    """The number of the row on offer: it comes with a row where the scan skips rows, otherwise rows are counted as they
    are ``taken``."""
    if derived.skips:
        return row.y
    y_next = Signal(range(max(2, derived.skin.rows)))
    with m.If(taken):
        m.d.sync += y_next.eq(Mux(row.last, 0, y_next + 1))
    return y_next
