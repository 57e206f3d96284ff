"""Zone records of frames as words, for a design that reads no packets."""

import math

from amaranth.hdl import Cat, Module, Mux, Signal, Value
from amaranth.lib import data, memory, stream, wiring
from amaranth.lib.wiring import In, Out

from contactfpga.skin import Skin
from contactfpga.skin.derived import TIME_BITS, Derived
from contactfpga_hdl.payloads import item_layout, summary_layout, tag_layout

NUMBER_BITS = 16


def closing_layout(derived: Derived) -> data.StructLayout:
    """The closing word of a frame: the trailer of docs/protocol.md without fields that only the host needs.

    ``number`` counts frames from 0, replaced ones included.
    """
    motion = {"motion": 1} if derived.skin.reads_rows else {}
    counted = {"cells": derived.area_bits, "zones": derived.zones_bits}
    flags = {"overflow": 1, "mismatch": 1, "fault": 1} | motion
    return data.StructLayout({"time": TIME_BITS, "number": NUMBER_BITS} | counted | flags)


def word_bits(derived: Derived) -> int:
    """Bits of a record and of a closing word, in whole bytes."""
    return 8 * max(derived.item_bytes, math.ceil(closing_layout(derived).size / 8))


class Records(wiring.Component):
    """Offers whole frames: records, then a closing word (:func:`closing_layout`).

    One half of a memory is filled while the other is read. A whole frame waits until the reader has the one before; if
    the next frame's first record comes earlier, it replaces the frame that waits, so a slow reader holds up nothing.
    With ``send = "on_change"`` the frame after a replaced one counts as changed, so that the newest cells always
    arrive. A bit of registers or memory that flips may spoil a frame or two unnoticed.

    item (in), taken (in): a frame's items and its end mark, and the clocks in which the packer takes them.
    send (in): with the end mark, whether the frame is sent.
    tag, summary (in): describe the frame in that clock.
    restart (in): drops the frame being filled.
    words (out): records and closing words. A frame's first word is offered three clocks after its end mark is taken, if
        the reader has the frame before; each further word in the clock after the one before is taken.
    """

    def __init__(self, skin: Skin):
        self.skin = skin
        self.derived = skin.derived
        word = data.StructLayout({"data": word_bits(self.derived), "last": 1})
        super().__init__(
            {
                "item": In(item_layout(self.derived)),
                "taken": In(1),
                "send": In(1),
                "tag": In(tag_layout(self.derived)),
                "summary": In(summary_layout(self.derived)),
                "restart": In(1),
                "words": Out(stream.Signature(word)),
            }
        )

    def elaborate(self, platform):
        m = Module()
        place = Signal(range(self.derived.max_items + 1))  # of the next word to be written
        end = Signal.like(place)  # the last word of the frame that waits
        frame_waits = Signal()
        must_keep = Signal()  # a frame was replaced
        read_half = Signal()  # number of the half that is read
        reading = Signal()  # words of it are left
        swaps = frame_waits & ~reading  # the halves change places
        replaced = must_keep | frame_waits & ~swaps
        keeps = self.item.end & (self.send | replaced)
        # Half that is filled
        m.submodules.store = store = memory.Memory(shape=word_bits(self.derived), depth=2 << len(place), init=[])
        write = store.write_port()
        m.d.comb += [
            write.en.eq(self.taken),
            write.addr.eq(Cat(place, ~read_half ^ swaps)),
            write.data.eq(Mux(self.item.end, self._closing(m, self.taken & keeps), self.item.data)),
        ]
        # Half that is read
        self._read(m, store.read_port(), read_half, reading, swaps, end)
        with m.If(swaps):
            m.d.sync += [frame_waits.eq(0), read_half.eq(~read_half)]
        # Frame that waits
        with m.If(self.taken):
            m.d.sync += [
                place.eq(Mux(self.item.end, 0, place + 1)),
                end.eq(place),
                frame_waits.eq(keeps),
                must_keep.eq(replaced & ~self.item.end),
            ]
        with m.If(self.restart):
            m.d.sync += place.eq(0)
        return m

    def _read(self, m: Module, read: memory.ReadPort, half: Value, reading: Signal, swaps: Value, end: Value) -> None:
        words = self.words
        place, last = Signal.like(end), Signal.like(end)
        closes = Signal()  # the word that is offered
        fetches = Signal()
        m.d.comb += [
            fetches.eq(reading & (~words.valid | words.ready)),
            read.en.eq(fetches),
            read.addr.eq(Cat(place, half)),
            words.payload.data.eq(read.data),
            words.payload.last.eq(closes),
        ]
        m.d.sync += words.valid.eq(fetches | words.valid & ~words.ready)
        with m.If(fetches):
            m.d.sync += [place.eq(place + 1), closes.eq(place == last), reading.eq(place != last)]
        with m.If(swaps):
            m.d.sync += [place.eq(0), last.eq(end), reading.eq(1)]

    def _closing(self, m: Module, kept: Value) -> Value:
        number = Signal(NUMBER_BITS)
        m.d.sync += number.eq(number + kept)
        closing = Signal(closing_layout(self.derived))
        m.d.comb += [
            closing.time.eq(self.tag.time),
            closing.number.eq(number),
            closing.cells.eq(self.summary.cells),
            closing.zones.eq(self.summary.zones),
            closing.overflow.eq(self.summary.overflow),
            closing.mismatch.eq(self.summary.mismatch),
            closing.fault.eq(self.tag.fault),
        ]
        if self.skin.reads_rows:
            m.d.comb += closing.motion.eq(self.tag.motion)
        return closing.as_value()
