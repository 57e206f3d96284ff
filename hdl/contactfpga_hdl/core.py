"""A Skin's gateware as part of another design."""

from typing import ClassVar

from amaranth.hdl import Module
from amaranth.lib import stream, wiring
from amaranth.lib.wiring import In, Out

from contactfpga.skin import Skin
from contactfpga_hdl.link.link import Link
from contactfpga_hdl.link.request import RequestReader
from contactfpga_hdl.top import Top, receiver_of

STREAM = {"m_axis_tdata": Out(8), "m_axis_tvalid": Out(1), "m_axis_tready": In(1), "m_axis_tlast": Out(1)}


class StreamTop(Top):
    """A Skin's gateware with ``bytes`` (out), a stream, instead of the transmit pin."""

    LINE: ClassVar = {"bytes": Out(stream.Signature(8)), "rx": In(1, init=1)}

    def _connect_line(self, m: Module, request: RequestReader, link: Link) -> None:
        receiver = self._put(m, "receiver", receiver_of(self.derived))
        self._put(m, "request", request)
        wiring.connect(m, link.bytes, wiring.flipped(self.bytes))
        wiring.connect(m, receiver.bits, request.bits)
        m.d.comb += receiver.pin.eq(self.rx)


class Core(wiring.Component):
    """A Skin's gateware between the pins of the sheet and a stream of bytes, in one clock domain.

    The pins of the sheet, ``rx``, ``contact`` and the pins of options are those of :class:`Top`.

    rx (in): requests and commands; while it stays high, the board sends what it does by itself.
    m_axis_tdata, m_axis_tvalid, m_axis_tlast (out), m_axis_tready (in): the packets of docs/protocol.md as an
        AXI4-Stream of bytes. ``m_axis_tlast`` is high with the delimiter, a packet's last byte. A newer frame replaces
        a waiting one, so a slow reader gets the newest.

    A Skin with ``dual`` has none: its two copies are compared at the transmit pin.
    """

    def __init__(self, skin: Skin):
        self._top = StreamTop(skin)
        ports = {name: member for name, member in self._top.signature.members.items() if name != "bytes"}
        super().__init__({**ports, **STREAM})

    def elaborate(self, platform):
        m = Module()
        m.submodules.top = top = self._top
        for name, member in top.signature.members.items():
            if name != "bytes":
                inside, outside = getattr(top, name), getattr(self, name)
                m.d.comb += outside.eq(inside) if member.flow == Out else inside.eq(outside)
        m.d.comb += [
            self.m_axis_tdata.eq(top.bytes.payload),
            self.m_axis_tvalid.eq(top.bytes.valid),
            self.m_axis_tlast.eq(top.bytes.payload == 0),
            top.bytes.ready.eq(self.m_axis_tready),
        ]
        return m
