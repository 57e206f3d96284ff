"""The ports of a labeller, which every labeller has."""

from amaranth.lib import stream, wiring
from amaranth.lib.wiring import In, Out

from contactfpga.skin.derived import Derived
from contactfpga_hdl.payloads import record_layout, row_layout


def labeller_ports(derived: Derived) -> dict[str, wiring.Member]:
    """Rows of cells in, zones out.

    rows (in): a frame's rows in ascending order.
    records (out): its zones, then an end mark.
    """
    return {
        "rows": In(stream.Signature(row_layout(derived))),
        "records": Out(stream.Signature(record_layout(derived))),
    }
