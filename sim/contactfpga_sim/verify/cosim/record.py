"""Common parts of co-simulation benches."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from contactfpga_sim.model.golden.facts import facts
from contactfpga_sim.model.golden.trace import Timeline, Trace
from contactfpga_sim.model.sheet import converter
from contactfpga_sim.model.sheet.shift import SheetAtPins

if TYPE_CHECKING:
    from contactfpga.skin import Skin

LEVELS = ("row_transfer", "record_transfer", "byte_transfer", "tx", "contact", "item_transfer", "alive")
"""Ports of the top that are read in every cycle; missing ones are low."""

PAYLOADS = ("row_cells", "row_last", "record_data", "record_end", "item_data", "item_end", "byte_data")
"""Ports of the top that are read at a transfer."""


def ports(names: tuple[str, ...], skin: Skin) -> tuple[str, ...]:
    """Those of the names that the Skin's top has."""
    has = {"item": skin.report == "barycenter", "alive": skin.alive}
    return tuple(name for name in names if has.get(name.split("_")[0], True))


_ROW, _RECORD, _BYTE, _TX, _CONTACT, _ITEM, _ALIVE = (1 << place for place in range(len(LEVELS)))


class OutOfTime(RuntimeError):
    """A simulation passed its wall-clock limit."""


class InputDriver:
    """Inputs of the board from sheet and line.

    ``reads``: the top's outputs to read; ``drives``: its inputs to set.
    """

    def __init__(self, skin: Skin, timeline: Timeline):
        self._sheet = SheetAtPins(skin)
        self._converter = converter.converter_of(skin)
        self.reads = self._sheet.reads + (self._converter.reads if self._converter else ())
        self.drives = (*self._sheet.drives, "rx", *(self._converter.gives if self._converter else ()))
        self._units = list(reversed(timeline.units))
        self._pieces = list(reversed(timeline.pieces))
        self._cuts = list(reversed(timeline.cuts))
        self._bit_clocks = facts(skin).bit_clocks
        self._received = list(reversed(timeline.received))
        self._start, self._data = 0, b""

    def pins(self, cycle: int, pins: Mapping[str, int]) -> tuple[int, ...]:
        """Levels of ``drives``, given those of ``reads``."""
        if self._pieces and self._pieces[-1][0] <= cycle:
            _, cells, stuck = self._pieces.pop()
            self._sheet.matrix.press(cells, stuck)
        if self._cuts and self._cuts[-1][0] <= cycle:
            _, cuts = self._cuts.pop()
            self._sheet.matrix.cut(cuts.rows, cuts.columns)
        return (*self._sheet.step(pins), self._rx(cycle), *self._convert(cycle, pins))

    def _convert(self, cycle: int, pins: Mapping[str, int]) -> tuple[int, ...]:
        if self._converter is None:
            return ()
        if self._units and self._units[-1][0] <= cycle:
            _, readings = self._units.pop()
            self._converter.codes[: len(readings)] = readings
        return self._converter.step(*(pins[name] for name in self._converter.reads))

    def _rx(self, cycle: int) -> int:
        if self._received and self._received[-1][0] == cycle:
            self._start, self._data = self._received.pop()
        byte, place = divmod((cycle - self._start) // self._bit_clocks, 10)
        if byte >= len(self._data):
            return 1
        return (1 << 9 | self._data[byte] << 1) >> place & 1  # stop, data, start; sent lowest first


class TraceRecorder:
    """Turns the top's probes into a trace, cycle by cycle."""

    def __init__(self, cycles: int):
        self.trace = Trace(cycles)
        self._levels = _TX

    def note(self, cycle: int, levels: int, read: Callable[[str], int]) -> None:
        """Record the :data:`LEVELS` in ``cycle``, the first lowest; ``read`` gives any other port's value."""
        if levels & _ROW:
            self.trace.rows.append((cycle, read("row_cells"), bool(read("row_last"))))
        if levels & _RECORD:
            self.trace.records.append((cycle, read("record_data"), bool(read("record_end"))))
        if levels & _ITEM:
            self.trace.items.append((cycle, read("item_data"), bool(read("item_end"))))
        if levels & _BYTE:
            self.trace.bytes.append((cycle, read("byte_data")))
        changed = levels ^ self._levels
        if changed & _TX:
            self.trace.line.append((cycle, int(bool(levels & _TX))))
        if changed & _CONTACT:
            self.trace.contact.append((cycle, int(bool(levels & _CONTACT))))
        if changed & _ALIVE:
            self.trace.alive.append((cycle, int(bool(levels & _ALIVE))))
        self._levels = levels
