"""A Skin's gateware on the pins of a board."""

import importlib
from collections.abc import Mapping

from amaranth.build import Attrs, Pins, Platform, Resource, ResourceError, Subsignal
from amaranth.hdl import Cat, ClockDomain, Const, Elaboratable, Module, Value
from amaranth.lib import io
from amaranth.lib.wiring import Member, Out

from contactfpga.boards.spec import BoardSpec
from contactfpga.skin import Skin, SkinError
from contactfpga.skin.several import Several
from contactfpga_hdl.board.clock import PllClock
from contactfpga_hdl.scan.pins import column_pins, drives_columns_both_ways, row_pins
from contactfpga_hdl.several import SeveralTop
from contactfpga_hdl.top import Top
from contactfpga_hdl.units.ports import unit_pins

_UART = 1
"""Number of the Skin's UART; the platform's own is 0."""


def platform_for(board: BoardSpec) -> Platform:
    """The board's platform, without resources of a sheet. Raises SkinError for a name that is not there."""
    module, _, name = board.platform.partition(":")
    try:
        return getattr(importlib.import_module(module), name)()
    except (ImportError, AttributeError, ValueError) as error:
        raise SkinError(f"{board.title}: `platform` is {board.platform!r}: {error}; it is module:class") from None


class BoardTop(Elaboratable):
    """Requests the pins and connects the Skin's :class:`Top` to them.

    The sheet must have passed :meth:`BoardSpec.check`. Rows are plain outputs, which the diode at each switch
    separates; without diodes a row is low or floats, since two may meet. Bidirectional lines have a buffer each.
    """

    def __init__(self, board: BoardSpec, skin: Skin):
        self.board = board
        self.skin = skin
        self._sheet = _outside(skin)

    def _check(self) -> None:
        """Raise SkinError that names the field of the :class:`BoardSpec` with a pin that the platform lacks or that is
        used twice."""
        platform = platform_for(self.board)
        if not self.board.uart and ("uart", 0) not in platform.resources:
            raise SkinError(
                f"{self.board.title}: `uart` is None and {self.board.platform} has none; name two pins for a bridge"
            )
        sides = dict.fromkeys(self._pins(), "row_side` or `column_side") | {"alive": "column_side"}
        for resource in self._resources():
            field = sides.get(resource.name, resource.name)
            try:
                platform.add_resources([resource])
                platform.request(resource.name, resource.number, dir="-")
            except (ResourceError, NameError) as error:
                raise SkinError(f"{self.board.title}: `{field}` has a pin that cannot be used: {error}") from None

    def elaborate(self, platform):
        self._check()
        m = Module()
        m.submodules.core = core = self._core()
        if self.skin.clock_hz != self.board.clock_hz:
            m.domains.sync = ClockDomain()
            m.submodules.clock = PllClock(self.board, self.skin.clock_hz)
        platform.add_resources(self._resources())
        uart = platform.request("uart", _UART if self.board.uart else 0, dir="-")
        m.submodules.rx = rx = io.Buffer("i", uart.rx)
        m.submodules.tx = tx = io.Buffer("o", uart.tx)
        m.submodules.contact = contact = io.Buffer("o", platform.request("contact", 0, dir="-"))
        self._connect_sheet(m, platform, core)
        m.d.comb += [
            contact.o.eq(core.contact),
            tx.o.eq(core.tx),
            core.rx.eq(rx.i),
        ]
        if self.board.held_high:
            port = platform.request("held_high", 0, dir="-")
            m.submodules.held_high = held_high = io.Buffer("o", port)
            m.d.comb += held_high.o.eq(~0)
        return m

    def _core(self) -> Top | SeveralTop:
        return Top(self.skin)

    def _pins(self) -> dict[str, tuple[str, ...]]:
        return self.board.pins(self.skin)

    def _connect_sheet(self, m: Module, platform: Platform, core: Top | SeveralTop) -> None:
        for name in self._pins():
            port, direction = platform.request(name, 0, dir="-"), self._direction(name)
            if name == "rows" and self.skin.ghosts:
                self._connect_floating(m, port, core.rows)
            elif direction == "io":
                self._connect_both_ways(m, name, port, core)
            else:
                m.submodules[name] = buffer = io.Buffer(direction, port)
                m.d.comb += buffer.o.eq(getattr(core, name)) if direction == "o" else getattr(core, name).eq(buffer.i)

    def _direction(self, name: str) -> str:
        if f"{name}_drive" in self._sheet:
            return "io"
        return "o" if self._sheet[name].flow == Out else "i"

    def _connect_both_ways(self, m: Module, name: str, port: io.SingleEndedPort, core: Top) -> None:
        """Connect a buffer per line, each with its own output enable. Without guard lines and self-test, columns are
        driven to the released level only."""
        levels, read = (core.rows, core.rows_read) if name == "rows" else (self._column_levels(core), core.columns)
        for line, (level, drive) in enumerate(zip(levels, getattr(core, f"{name}_drive"), strict=True)):
            m.submodules[f"{name}_{line}"] = buffer = io.Buffer("io", port[line])
            m.d.comb += [buffer.o.eq(level), buffer.oe.eq(drive), read[line].eq(buffer.i)]

    def _column_levels(self, core: Top) -> Value:
        if not drives_columns_both_ways(self.skin):
            return Const(-int(self.skin.selects_low), self.skin.column_lines)
        level = core.columns_level.replicate(self.skin.columns)
        return Cat(level, ~core.columns_level) if self.skin.guard else level

    def _connect_floating(self, m: Module, port: io.SingleEndedPort, rows: Value) -> None:
        for row in range(self.skin.rows):
            m.submodules[f"row_{row}"] = buffer = io.Buffer("o", port[row])
            m.d.comb += [buffer.o.eq(0), buffer.oe.eq(~rows[row])]

    def _pulls(self, name: str) -> Mapping[str, object]:
        up = self.skin.selects_low == (name == "columns")
        needs = (name == "columns" and not self.skin.ruler) or f"{name}_read" in self._sheet
        return self.board.pulls["col2row" if up else "row2col"] if needs else {}

    def _resources(self) -> list[Resource]:
        board = self.board
        attrs = Attrs(**board.standard)
        resources = [Resource("contact", 0, Pins(board.contact, dir="o"), attrs)]
        for name, pins in self._pins().items():
            direction = self._direction(name)
            resources.append(
                Resource(name, 0, Pins(" ".join(pins), dir=direction), Attrs(**board.standard, **self._pulls(name)))
            )
        if board.uart:
            rx, tx = board.uart  # nothing may be plugged in: received is then a line at rest
            pulled = Attrs(**board.standard, **board.pulls["col2row"])
            lines = Subsignal("rx", Pins(rx, dir="i"), pulled), Subsignal("tx", Pins(tx, dir="o"), attrs)
            resources.append(Resource("uart", _UART, *lines))
        if board.held_high:
            resources.append(Resource("held_high", 0, Pins(" ".join(board.held_high), dir="o"), attrs))
        return resources


def _outside(skin: Skin) -> dict[str, Member]:
    """Ports of a sheet, its converter and ``alive``."""
    return row_pins(skin) | column_pins(skin) | unit_pins(skin) | ({"alive": Out(1)} if skin.alive else {})


class SheetsTop(BoardTop):
    """A board top for several sheets, whose lines are all on shift registers."""

    def __init__(self, board: BoardSpec, several: Several):
        super().__init__(board, several.skins[0])
        self.several = several
        self._sheet = {
            f"{name}_{number}": member
            for number, skin in enumerate(several.skins)
            for name, member in _outside(skin).items()
        }

    def _core(self) -> SeveralTop:
        return SeveralTop(self.several)

    def _pins(self) -> dict[str, tuple[str, ...]]:
        return self.board.pins(self.several)

    def _pulls(self, name: str) -> Mapping[str, object]:
        """With guard lines, a pull to the released level at the data of a sheet that may be unplugged."""
        port, _, number = name.rpartition("_")
        skin = self.several.skins[int(number)]
        pulled = port == "column_data" and skin.guard
        return self.board.pulls["col2row" if skin.selects_low else "row2col"] if pulled else {}
