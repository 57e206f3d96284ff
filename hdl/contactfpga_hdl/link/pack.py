"""Items to the bytes of a frame, with trailer and COBS stuffing."""

from amaranth.hdl import Module, Mux, Signal, Value
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from contactfpga.skin import Skin
from contactfpga.skin.derived import HEARD_BITS, SEQUENCE_BITS, TIME_BITS, Derived
from contactfpga.wire import protocol
from contactfpga_hdl.payloads import item_layout, summary_layout, tag_layout

FULL_BLOCK = 255


def verdict_layout(derived: Derived) -> data.StructLayout:
    """The link's decision on a frame whose end mark is packed: ``send`` at once, the rest one clock later."""
    return data.StructLayout({"send": 1, "sequence": SEQUENCE_BITS, "overwritten": derived.overwritten_bits})


def frames_signature(derived: Derived, offset_bits: int) -> wiring.Signature:
    """Frames from the packer, the initiator, to the link.

    write: a byte and its offset in the frame's region.
    decide: pulse as an end mark is taken.
    verdict (in): the link's decision in that clock, with its numbers until ``commit``.
    commit: pulse as the frame's last byte is written; later writes belong to another frame.
    end: in that clock, the offset after the last byte.
    """
    return wiring.Signature(
        {
            "write": Out(wiring.Signature({"en": Out(1), "offset": Out(offset_bits), "data": Out(8)})),
            "decide": Out(1),
            "verdict": In(verdict_layout(derived)),
            "commit": Out(1),
            "end": Out(offset_bits),
        }
    )


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
            "fault": 1,
            "motion": protocol.FLAG_BITS - 3,
            "kind": protocol.KIND_BITS,
        }
    )


class Packer(wiring.Component):
    """Writes each frame, stuffed, into a region of a memory from offset 0, one byte per clock.

    An item is taken with its last byte. A zero byte is the place of the next COBS block's length, so each byte needs
    one write: itself, or, for a zero, the length of the block that it ends. Only a block of 254 bytes without a zero
    needs one more.

    items (in): a frame's items and its end mark.
    tag, summary (in): describe the frame from ``frames.decide`` to ``frames.commit``.
    frames (out): see :func:`frames_signature`.
    """

    def __init__(self, skin: Skin, offset_bits: int):
        self.skin = skin
        self.derived = skin.derived
        super().__init__(
            {
                "items": In(stream.Signature(item_layout(self.derived))),
                "tag": In(tag_layout(self.derived)),
                "summary": In(summary_layout(self.derived)),
                "frames": Out(frames_signature(self.derived, offset_bits)),
            }
        )

    def elaborate(self, platform):
        m = Module()
        plain = stream.Signature(8).create()  # the frame's bytes before they are stuffed
        restart = Signal()  # the next of them is a frame's first one
        # Bytes of items, then of the trailer
        item_bytes, trailer_bytes = self.derived.item_bytes, self.derived.trailer_bytes
        decide, send = self.frames.decide, self.frames.verdict.send
        index = Signal(range(max(item_bytes, trailer_bytes + 1)))
        item, trailer = self.items.payload.data, self._trailer(m)
        free = ~plain.valid | plain.ready
        ends = self.items.valid & self.items.payload.end
        with m.If(free):
            m.d.sync += plain.valid.eq(0)
        with m.FSM(name="part") as part:
            with m.State("ITEMS"):
                last = index == item_bytes - 1
                m.d.comb += [
                    self.items.ready.eq(free & (self.items.payload.end | last)),
                    decide.eq(free & ends),
                    restart.eq(decide & ~send),
                ]
                with m.If(free & self.items.valid & ~self.items.payload.end):
                    m.d.sync += [plain.valid.eq(1), index.eq(Mux(last, 0, index + 1))]
                with m.If(decide & send):
                    m.d.sync += [plain.valid.eq(1), index.eq(1)]
                    m.next = "TRAILER"
            with m.State("TRAILER"):
                with m.If(free):
                    m.d.sync += [plain.valid.eq(1), index.eq(index + 1)]
                    with m.If(index == trailer_bytes):
                        m.d.sync += [plain.valid.eq(0), index.eq(0)]
                        m.next = "CLOSE"
            with m.State("CLOSE"):
                m.d.comb += [self.frames.commit.eq(1), restart.eq(1)]
                m.next = "ITEMS"
        from_trailer = part.ongoing("TRAILER") | ends
        with m.If(free):
            m.d.sync += plain.payload.eq(Mux(from_trailer, trailer.word_select(index, 8), item.word_select(index, 8)))
        # COBS: ``code`` is the place of the open block's length, ``length`` its value so far
        write, commit = self.frames.write, self.frames.commit
        code = Signal.like(write.offset)
        place = Signal.like(write.offset, init=1)
        longest = min(FULL_BLOCK, self.derived.max_stored_bytes)
        length = Signal(range(longest + 1), init=1)
        full = Signal()  # the block is as long as one may be
        ends_block = Signal()
        m.d.comb += [
            ends_block.eq(commit | full | (plain.payload == 0)),
            plain.ready.eq(~full),
            self.frames.end.eq(place),
            write.en.eq(plain.valid | commit),
            write.offset.eq(Mux(ends_block, code, place)),
            write.data.eq(Mux(ends_block, length, plain.payload)),
        ]
        with m.If(restart):
            m.d.sync += [code.eq(0), place.eq(1), length.eq(1), full.eq(0)]
        with m.Elif(plain.valid):
            m.d.sync += place.eq(place + 1)
            with m.If(ends_block):
                m.d.sync += [code.eq(place), length.eq(1), full.eq(0)]
            with m.Else():
                m.d.sync += [length.eq(length + 1), full.eq(length == FULL_BLOCK - 1)]
        return m

    def _trailer(self, m: Module) -> Value:
        trailer = Signal(_trailer_layout(self.derived))
        m.d.comb += [
            trailer.time.eq(self.tag.time),
            trailer.sequence.eq(self.frames.verdict.sequence),
            trailer.overwritten.eq(self.frames.verdict.overwritten),
            trailer.overflow.eq(self.summary.overflow),
            trailer.mismatch.eq(self.summary.mismatch),
            trailer.fault.eq(self.tag.fault),
            trailer.motion.eq(self.tag.motion if self.skin.reads_rows else 0),
            trailer.heard.eq(self.tag.heard),
            trailer.cells.eq(self.summary.cells),
            trailer.zones.eq(self.summary.zones),
            trailer.kind.eq(protocol.KINDS[self.skin.report]),
        ]
        return trailer.as_value()
