"""A Skin's gateware as part of another design."""

from typing import ClassVar

from amaranth.hdl import Module
from amaranth.lib import stream, wiring
from amaranth.lib.wiring import In, Out

from contactfpga.skin import Skin
from contactfpga_hdl.link.link import Link
from contactfpga_hdl.link.records import Records, word_bits
from contactfpga_hdl.link.request import RequestReader
from contactfpga_hdl.top import Top, receiver_of

BYTES, RECORDS = "m_axis", "m_axis_records"
"""Prefixes of the streams' port names."""


def _stream(name: str, bits: int) -> dict[str, wiring.Member]:
    return {f"{name}_tdata": Out(bits), f"{name}_tvalid": Out(1), f"{name}_tready": In(1), f"{name}_tlast": Out(1)}


class StreamTop(Top):
    """A Skin's gateware with streams: ``bytes`` (out) instead of the transmit pin, and ``records`` (out)."""

    LINE: ClassVar = {"bytes": Out(stream.Signature(8)), "rx": In(1, init=1)}

    def __init__(self, skin: Skin):
        super().__init__(skin)
        self.records = Records(skin)

    def elaborate(self, platform):
        m = super().elaborate(platform)
        m.submodules.records = records = self.records
        packer = m.submodules.packer
        m.d.comb += [
            records.item.eq(packer.items.payload),
            records.taken.eq(packer.items.valid & packer.items.ready),
            records.send.eq(packer.frames.verdict.send),
            records.tag.eq(packer.tag),
            records.summary.eq(packer.summary),
            records.restart.eq(self._restarts),
        ]
        return m

    def _connect_line(self, m: Module, request: RequestReader, link: Link) -> None:
        receiver = self._put(m, "receiver", receiver_of(self.derived))
        self._put(m, "request", request)
        wiring.connect(m, link.bytes, wiring.flipped(self.bytes))
        wiring.connect(m, receiver.bits, request.bits)
        m.d.comb += receiver.pin.eq(self.rx)


class Core(wiring.Component):
    """A Skin's gateware between the pins of the sheet and two streams, in one clock domain.

    Other pins are those of :class:`Top`. A Skin with ``dual`` has no core: its copies are compared at the transmit pin.

    rx (in): requests and commands; while it stays high, the board sends unrequested packets.
    m_axis_tdata, m_axis_tvalid, m_axis_tlast (out), m_axis_tready (in): packets as an AXI4-Stream of bytes;
        ``m_axis_tlast`` is high with the delimiter. A new frame replaces a waiting one, so a slow reader gets the
        newest.
    m_axis_records_tdata, m_axis_records_tvalid, m_axis_records_tlast (out), m_axis_records_tready (in): the same frames
        as an AXI4-Stream of words, see :class:`~contactfpga_hdl.link.records.Records`.
    """

    def __init__(self, skin: Skin):
        self._top = StreamTop(skin)
        ports = {name: member for name, member in self._top.signature.members.items() if name != "bytes"}
        super().__init__({**ports, **_stream(BYTES, 8), **_stream(RECORDS, word_bits(skin.derived))})

    def elaborate(self, platform):
        m = Module()
        m.submodules.top = top = self._top
        for name, member in top.signature.members.items():
            if name != "bytes":
                inside, outside = getattr(top, name), getattr(self, name)
                m.d.comb += outside.eq(inside) if member.flow == Out else inside.eq(outside)
        words = top.records.words
        m.d.comb += [
            self.m_axis_tdata.eq(top.bytes.payload),
            self.m_axis_tvalid.eq(top.bytes.valid),
            self.m_axis_tlast.eq(top.bytes.payload == 0),
            top.bytes.ready.eq(self.m_axis_tready),
            self.m_axis_records_tdata.eq(words.payload.data),
            self.m_axis_records_tvalid.eq(words.valid),
            self.m_axis_records_tlast.eq(words.payload.last),
            words.ready.eq(self.m_axis_records_tready),
        ]
        return m
