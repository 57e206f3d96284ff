"""Items to the bytes of a frame: items and trailer, stuffed with COBS as they are written."""

from amaranth.hdl import Module, Mux, Signal
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from contactfpga.skin import Skin
from contactfpga.skin.derived import HEARD_BITS, SEQUENCE_BITS, TIME_BITS, Derived
from contactfpga.wire import protocol
from contactfpga_hdl.payloads import item_layout, summary_layout, tag_layout

FULL_BLOCK = 255
"""Length of a COBS block that holds all the bytes it can."""


def verdict_layout(derived: Derived) -> data.StructLayout:
    """What the link decides about a frame whose end mark is packed: ``send`` at once, the rest one clock later."""
    return data.StructLayout({"send": 1, "sequence": SEQUENCE_BITS, "overwritten": derived.overwritten_bits})


def _trailer_layout(derived: Derived) -> data.StructLayout:
    return data.StructLayout(
        {
            "time": TIME_BITS,
            "sequence": SEQUENCE_BITS,
            "heard": HEARD_BITS,
            "cells": derived.area_bits,
            "zones": derived.zones_bits,
            "overwritten": derived.overwritten_bits,
            "overflow": 1,
            "mismatch": 1,
            "fault": protocol.FLAG_BITS - 2,
            "kind": protocol.KIND_BITS,
        }
    )


class Packer(wiring.Component):
    """Writes each frame, stuffed, into a region of a memory, from offset 0 on; a byte a clock.

    An item is taken with its last byte. ``decide`` is high for the clock in which an end mark is taken; in it
    ``verdict`` says whether the frame is sent, and until the ``commit`` ``tag`` and ``summary`` describe it.
    ``commit`` is high for the clock in which the frame's last write is done; ``end`` is then the offset behind its
    last byte, and what is written from the next clock on belongs to another frame.

    COBS writes a block's length in front of it. Every zero byte is the place of the next length, so a byte takes one
    write: itself, or, for a zero, the length of the block that it ends. Only a block of 254 bytes without a zero takes
    one more.
    """

    def __init__(self, skin: Skin, offset_bits: int):
        self.skin = skin
        self.derived = Derived(skin)
        super().__init__(
            {
                "items": In(stream.Signature(item_layout(self.derived))),
                "tag": In(tag_layout(self.derived)),
                "summary": In(summary_layout(self.derived)),
                "decide": Out(1),
                "verdict": In(verdict_layout(self.derived)),
                "commit": Out(1),
                "end": Out(offset_bits),
                "write": Out(wiring.Signature({"en": Out(1), "offset": Out(offset_bits), "data": Out(8)})),
            }
        )

    def elaborate(self, platform):
        m = Module()
        self._byte = Signal(8)  # the one that is written
        self._byte_valid = Signal()
        self._byte_ready = Signal()
        self._restart = Signal()
        self._stuff(m)
        self._sequence_bytes(m)
        return m

    def _sequence_bytes(self, m):
        """Items as they come, each taken with its last byte, then the trailer."""
        item_bytes, trailer_bytes = self.derived.item_bytes, self.derived.trailer_bytes
        index = Signal(range(max(item_bytes, trailer_bytes + 1)))
        item, trailer = self.items.payload.data, self._trailer(m)
        free = ~self._byte_valid | self._byte_ready
        ends = self.items.valid & self.items.payload.end
        with m.If(free):
            m.d.sync += self._byte_valid.eq(0)
        with m.FSM(name="part") as part:
            with m.State("ITEMS"):
                last = index == item_bytes - 1
                m.d.comb += [
                    self.items.ready.eq(free & (self.items.payload.end | last)),
                    self.decide.eq(free & ends),
                    self._restart.eq(self.decide & ~self.verdict.send),
                ]
                with m.If(free & self.items.valid & ~self.items.payload.end):
                    m.d.sync += [self._byte_valid.eq(1), index.eq(Mux(last, 0, index + 1))]
                with m.If(self.decide & self.verdict.send):
                    m.d.sync += [self._byte_valid.eq(1), index.eq(1)]
                    m.next = "TRAILER"
            with m.State("TRAILER"):
                with m.If(free):
                    m.d.sync += [self._byte_valid.eq(1), index.eq(index + 1)]
                    with m.If(index == trailer_bytes):
                        m.d.sync += [self._byte_valid.eq(0), index.eq(0)]
                        m.next = "CLOSE"
            with m.State("CLOSE"):
                m.d.comb += [self.commit.eq(1), self._restart.eq(1)]
                m.next = "ITEMS"
        from_trailer = part.ongoing("TRAILER") | ends
        with m.If(free):
            m.d.sync += self._byte.eq(Mux(from_trailer, trailer.word_select(index, 8), item.word_select(index, 8)))

    def _trailer(self, m):
        trailer = Signal(_trailer_layout(self.derived))
        m.d.comb += [
            trailer.time.eq(self.tag.time),
            trailer.sequence.eq(self.verdict.sequence),
            trailer.overwritten.eq(self.verdict.overwritten),
            trailer.overflow.eq(self.summary.overflow),
            trailer.mismatch.eq(self.summary.mismatch),
            trailer.fault.eq(self.tag.stuck.any()),
            trailer.heard.eq(self.tag.heard),
            trailer.cells.eq(self.summary.cells),
            trailer.zones.eq(self.summary.zones),
            trailer.kind.eq(protocol.KINDS[self.skin.report]),
        ]
        return trailer.as_value()

    def _stuff(self, m):
        """COBS: ``code`` is the place of the open block's length, ``length`` that length so far."""
        code = Signal.like(self.write.offset)
        place = Signal.like(self.write.offset, init=1)
        longest = min(FULL_BLOCK, self.derived.max_stored_bytes)
        length = Signal(range(longest + 1), init=1)
        full = length == FULL_BLOCK
        ends_block = self.commit | full | (self._byte == 0)
        m.d.comb += [
            self._byte_ready.eq(~full),
            self.end.eq(place),
            self.write.en.eq(self._byte_valid | self.commit),
            self.write.offset.eq(Mux(ends_block, code, place)),
            self.write.data.eq(Mux(ends_block, length, self._byte)),
        ]
        with m.If(self._restart):
            m.d.sync += [code.eq(0), place.eq(1), length.eq(1)]
        with m.Elif(self._byte_valid):
            m.d.sync += place.eq(place + 1)
            with m.If(ends_block):
                m.d.sync += [code.eq(place), length.eq(1)]
            with m.Else():
                m.d.sync += length.eq(length + 1)
