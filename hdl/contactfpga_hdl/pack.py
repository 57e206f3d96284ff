"""Items to bytes on the wire: lead, items, trailer and CRC, stuffed with COBS as they are written."""

from amaranth.hdl import Module, Mux, Signal
from amaranth.lib import crc, data, stream, wiring
from amaranth.lib.wiring import In, Out

from contactfpga import protocol
from contactfpga.derived import Derived
from contactfpga.skin import Skin
from contactfpga_hdl.payloads import item_layout, summary_layout


def verdict_layout() -> data.StructLayout:
    """What the link decides about a frame whose end mark is packed."""
    return data.StructLayout(
        {"send": 1, "sequence": protocol.COUNTER_BITS, "overwritten": protocol.COUNTER_BITS, "requested": 1}
    )


def _trailer_layout(derived: Derived) -> data.StructLayout:
    return data.StructLayout(
        {
            "time": protocol.TIME_BITS,
            "sequence": protocol.COUNTER_BITS,
            "overwritten": protocol.COUNTER_BITS,
            "overflow": 1,
            "mismatch": 1,
            "requested": 1,
            "stuck": protocol.STUCK_BITS,
            "cells": derived.area_bits,
            "zones": derived.zones_bits,
        }
    )


class Packer(wiring.Component):
    """Writes each frame, stuffed, into the memory region that starts at ``base``; a byte a clock.

    ``decide`` is high for the clock in which an end mark is taken; in it ``summary`` describes the frame and
    ``verdict`` says whether it is sent. ``commit`` is high for the clock in which a frame's last byte is written;
    ``end`` is then the address behind it. ``base`` is then already the next region.

    COBS writes a block's length in front of it. Every zero byte is the place of the next length, so a byte takes one
    write: itself, or, for a zero, the length of the block that it ends. Only a block of 254 bytes without a zero takes
    one more.
    """

    def __init__(self, skin: Skin, address_bits: int):
        self.skin = skin
        self.derived = Derived(skin)
        super().__init__(
            {
                "items": In(stream.Signature(item_layout(self.derived))),
                "summary": In(summary_layout(self.derived)),
                "decide": Out(1),
                "verdict": In(verdict_layout()),
                "base": In(address_bits),
                "commit": Out(1),
                "end": Out(address_bits),
                "write": Out(wiring.Signature({"en": Out(1), "addr": Out(address_bits), "data": Out(8)})),
            }
        )

    def elaborate(self, platform):
        m = Module()
        self._byte = Signal(8)
        self._byte_valid = Signal()
        self._byte_ready = Signal()
        self._restart = Signal()
        m.submodules.crc = self._crc = crc.catalog.CRC16_IBM_3740(data_width=8).create()
        self._stuff(m)
        self._sequence_bytes(m)
        return m

    def _sequence_bytes(self, m):
        """Lead, then items as they come, then trailer and CRC."""
        trailer_bytes = self.derived.trailer_bytes
        item_bytes = self.derived.item_bytes
        shift = Signal(8 * max(trailer_bytes, item_bytes))
        left = Signal(range(max(trailer_bytes, item_bytes) + 1))
        kind = protocol.KIND_ZONES if self.skin.report == "moments" else protocol.KIND_CELLS
        m.d.comb += [
            self._crc.valid.eq(self._byte_valid & self._byte_ready & ~self._restart),  # a dropped frame's last byte
            self._crc.data.eq(self._byte),
            self._crc.start.eq(self._restart),
        ]
        with m.FSM(name="part"):
            with m.State("LEAD"):
                m.d.comb += [self._byte_valid.eq(1), self._byte.eq(protocol.lead_byte(kind))]
                m.next = "ITEMS"
            with m.State("ITEMS"):
                m.d.comb += [
                    self._byte_valid.eq(left != 0),
                    self._byte.eq(shift[:8]),
                    self.items.ready.eq((left == 0) | (left == 1) & self._byte_ready),
                ]
                with m.If(self._byte_valid & self._byte_ready):
                    m.d.sync += [shift.eq(shift >> 8), left.eq(left - 1)]
                with m.If(self.items.valid & self.items.ready):
                    m.d.sync += [shift.eq(self.items.payload.data), left.eq(item_bytes)]
                    with m.If(self.items.payload.end):
                        m.d.comb += self.decide.eq(1)
                        m.d.sync += [shift.eq(self._trailer(m)), left.eq(trailer_bytes)]
                        with m.If(self.verdict.send):
                            m.next = "TRAILER"
                        with m.Else():
                            m.d.comb += self._restart.eq(1)
                            m.d.sync += left.eq(0)
                            m.next = "LEAD"
            with m.State("TRAILER"):
                m.d.comb += [self._byte_valid.eq(1), self._byte.eq(shift[:8])]
                with m.If(self._byte_ready):
                    m.d.sync += [shift.eq(shift >> 8), left.eq(left - 1)]
                    with m.If(left == 1):
                        m.next = "CRC"
            with m.State("CRC"):
                m.d.comb += [self._byte_valid.eq(1), self._byte.eq(self._crc.crc[8:])]
                with m.If(self._byte_ready):
                    m.d.sync += shift.eq(self._crc.crc[:8])
                    m.next = "CRC_LOW"
            with m.State("CRC_LOW"):
                m.d.comb += [self._byte_valid.eq(1), self._byte.eq(shift[:8])]
                with m.If(self._byte_ready):
                    m.next = "CLOSE"
            with m.State("CLOSE"):
                m.d.comb += [self.commit.eq(1), self._restart.eq(1)]
                m.next = "LEAD"

    def _trailer(self, m):
        trailer = Signal(_trailer_layout(self.derived))
        m.d.comb += [
            trailer.time.eq(self.summary.tag.time),
            trailer.sequence.eq(self.verdict.sequence),
            trailer.overwritten.eq(self.verdict.overwritten),
            trailer.overflow.eq(self.summary.overflow),
            trailer.mismatch.eq(self.summary.mismatch),
            trailer.requested.eq(self.verdict.requested),
            trailer.stuck.eq(self.summary.tag.stuck),
            trailer.cells.eq(self.summary.cells),
            trailer.zones.eq(self.summary.zones),
        ]
        return trailer.as_value()

    def _stuff(self, m):
        """COBS: ``code`` is the place of the open block's length, ``length`` that length so far."""
        code = Signal.like(self.write.addr)
        place = Signal.like(self.write.addr, init=1)
        length = Signal(8, init=1)
        full = length == 255
        ends_block = self.commit | full | (self._byte == 0)
        m.d.comb += [
            self._byte_ready.eq(~full),
            self.end.eq(place),
            self.write.en.eq(self._byte_valid | self.commit),
            self.write.addr.eq(Mux(ends_block, code, place)),
            self.write.data.eq(Mux(ends_block, length, self._byte)),
        ]
        with m.If(self._restart):
            m.d.sync += [code.eq(self.base), place.eq(self.base + 1), length.eq(1)]
        with m.Elif(self._byte_valid):
            m.d.sync += place.eq(place + 1)
            with m.If(ends_block):
                m.d.sync += [code.eq(place), length.eq(1)]
            with m.Else():
                m.d.sync += length.eq(length + 1)
