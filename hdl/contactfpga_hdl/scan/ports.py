"""The ports of a scan, which every scan has."""

from amaranth.lib import stream, wiring
from amaranth.lib.wiring import In, Out

from contactfpga.skin.derived import HEARD_BITS, Derived
from contactfpga_hdl.payloads import faults_layout, row_layout, tag_layout
from contactfpga_hdl.scan.pins import column_pins, row_pins
from contactfpga_hdl.scan.sample_at import sample_at_ports


def scan_ports(derived: Derived) -> dict[str, wiring.Member]:
    """Between the sheet, the stages that take its rows, and the link.

    pins: those of the row driver and of the column reader.
    rows (out): rows in ascending order.
    tag (out): of the frame whose last row's strobe was; when it is complete is the scan's rule.
    request (in): high for a clock; the tag of the next frame to start answers it with ``requested``.
    heard (in): taken over into that tag.
    epoch (out): high for a clock when another 2^22 us are over.
    faults (out): with ``guard`` or ``self_test``, what it knows of faulty lines.
    upset (out): high for a clock when a register was found to have turned by itself, see
    :func:`~contactfpga_hdl.util.upset.upset`; never with ``dual``, which finds more.
    contact (out): high while any switch reads pressed; when it rises and falls is the scan's rule.
    """
    skin = derived.skin
    faults = faults_layout(derived)
    return {
        "pins": Out(wiring.Signature(row_pins(skin) | column_pins(skin))),
        "rows": Out(stream.Signature(row_layout(derived))),
        "tag": Out(tag_layout(derived)),
        "request": In(1),
        "heard": In(HEARD_BITS),
        "epoch": Out(1),
        "upset": Out(1),
        "contact": Out(1),
        **({"faults": Out(faults)} if faults.size else {}),
        **sample_at_ports(derived),
    }
