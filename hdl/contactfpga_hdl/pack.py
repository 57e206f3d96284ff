"""Items to the bytes of a frame: items and trailer, stuffed with COBS as they are written."""

from amaranth.hdl import Module, Mux, Signal
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from contactfpga import protocol
from contactfpga.derived import SEQUENCE_BITS, STUCK_BITS, TIME_BITS, Derived
from contactfpga.skin import Skin
from contactfpga_hdl.payloads import item_layout, summary_layout


def verdict_layout(derived: Derived) -> data.StructLayout:
    """What the link decides about a frame whose end mark is packed."""
    return data.StructLayout(
        {"send": 1, "sequence": SEQUENCE_BITS, "overwritten": derived.overwritten_bits, "requested": 1}
    )


def _trailer_layout(derived: Derived) -> data.StructLayout:
    return data.StructLayout(
        {
            "time": TIME_BITS,
            "sequence": SEQUENCE_BITS,
            "stuck": STUCK_BITS,
            "cells": derived.area_bits,
            "zones": derived.zones_bits,
            "overwritten": derived.overwritten_bits,
            "overflow": 1,
            "mismatch": 1,
            "requested": 1,
            "kind": protocol.KIND_BITS,
            "version": 8 - protocol.FLAG_BITS - protocol.KIND_BITS,
        }
    )


class Packer(wiring.Component):
    """Writes each frame, stuffed, into the memory region that starts at ``base``; a byte a clock.

    ``decide`` is high for the clock in which an end mark is taken; in it ``summary`` describes the frame and
    ``verdict`` says whether it is sent. ``commit`` is high for the clock in which a frame's last byte is written;
    ``end`` is then the address behind it. ``base`` (even) is then already the next region.

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
                "verdict": In(verdict_layout(self.derived)),
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
        self._stuff(m)
        self._sequence_bytes(m)
        return m

    def _sequence_bytes(self, m):
        """Items as they come, then the trailer."""
        trailer_bytes = self.derived.trailer_bytes
        item_bytes = self.derived.item_bytes
        shift = Signal(8 * max(trailer_bytes, item_bytes))
        left = Signal(range(max(trailer_bytes, item_bytes) + 1))
        trailer = self._trailer(m)
        m.d.comb += [self._byte_valid.eq(left != 0), self._byte.eq(shift[:8])]
        with m.If(self._byte_valid & self._byte_ready):
            m.d.sync += [shift.eq(shift >> 8), left.eq(left - 1)]
        with m.FSM(name="part"):
            with m.State("ITEMS"):
                m.d.comb += self.items.ready.eq((left == 0) | (left == 1) & self._byte_ready)
                with m.If(self.items.valid & self.items.ready):
                    m.d.sync += [shift.eq(self.items.payload.data), left.eq(item_bytes)]
                    with m.If(self.items.payload.end):
                        m.d.comb += self.decide.eq(1)
                        with m.If(self.verdict.send):
                            m.d.sync += [shift.eq(trailer), left.eq(trailer_bytes)]
                            m.next = "TRAILER"
                        with m.Else():
                            m.d.comb += self._restart.eq(1)
                            m.d.sync += left.eq(0)
            with m.State("TRAILER"):
                with m.If((left == 1) & self._byte_ready):
                    m.next = "CLOSE"
            with m.State("CLOSE"):
                m.d.comb += [self.commit.eq(1), self._restart.eq(1)]
                m.next = "ITEMS"

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
            trailer.kind.eq(protocol.KIND_ZONES if self.skin.report == "moments" else protocol.KIND_CELLS),
            trailer.version.eq(protocol.VERSION),
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
            m.d.sync += [code.eq(self.base), place.eq(self.base | 1), length.eq(1)]
        with m.Elif(self._byte_valid):
            m.d.sync += place.eq(place + 1)
            with m.If(ends_block):
                m.d.sync += [code.eq(place), length.eq(1)]
            with m.Else():
                m.d.sync += length.eq(length + 1)
