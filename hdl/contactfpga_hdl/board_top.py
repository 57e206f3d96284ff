"""A Skin's gateware on the pins of a board."""

import importlib

from amaranth.build import Attrs, Pins, Resource
from amaranth.hdl import Elaboratable, Module
from amaranth.lib import io

from contactfpga.skin import Skin
from contactfpga_hdl.boards import Board
from contactfpga_hdl.top import Top


def platform_for(board: Board):
    """A fresh platform of the board, as amaranth-boards has it."""
    module, _, name = board.platform.partition(":")
    return getattr(importlib.import_module(module), name)()


class BoardTop(Elaboratable):
    """Requests the pins and wires the Skin's :class:`Top` to them.

    The sheet must have passed :meth:`Board.check`. Rows are plain outputs: the diode at each switch keeps two of
    them apart.
    """

    def __init__(self, board: Board, skin: Skin):
        self.board = board
        self.skin = skin

    def elaborate(self, platform):
        m = Module()
        m.submodules.core = core = Top(self.skin)
        platform.add_resources(self._resources())
        uart = platform.request("uart", 0, dir="-")
        ports = {name: platform.request(name, 0, dir="-") for name in ("rows", "columns", "contact")}
        m.submodules.rx = rx = io.Buffer("i", uart.rx)
        m.submodules.tx = tx = io.Buffer("o", uart.tx)
        m.submodules.rows = rows = io.Buffer("o", ports["rows"])
        m.submodules.columns = columns = io.Buffer("i", ports["columns"])
        m.submodules.contact = contact = io.Buffer("o", ports["contact"])
        m.d.comb += [
            rows.o.eq(core.rows),
            core.columns.eq(columns.i),
            contact.o.eq(core.contact),
            tx.o.eq(core.tx),
            core.rx.eq(rx.i),
        ]
        if self.board.held_high:
            port = platform.request("held_high", 0, dir="-")
            m.submodules.held_high = held_high = io.Buffer("o", port)
            m.d.comb += held_high.o.eq(~0)
        return m

    def _resources(self):
        board, skin = self.board, self.skin
        attrs = Attrs(**board.standard)
        column_attrs = Attrs(**board.standard, **board.pulls[skin.diodes])
        resources = [
            Resource("rows", 0, Pins(" ".join(board.rows(skin.rows)), dir="o"), attrs),
            Resource("columns", 0, Pins(" ".join(board.columns(skin.columns)), dir="i"), column_attrs),
            Resource("contact", 0, Pins(board.contact, dir="o"), attrs),
        ]
        if board.held_high:
            resources.append(Resource("held_high", 0, Pins(" ".join(board.held_high), dir="o"), attrs))
        return resources
