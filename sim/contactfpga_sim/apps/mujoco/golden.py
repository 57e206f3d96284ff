"""A board with frames by the golden model, for speed."""

from __future__ import annotations

import numpy as np

from contactfpga.errors import ContactFPGAError
from contactfpga.skin import Skin
from contactfpga_sim.model.board.compiled import EVENT
from contactfpga_sim.model.golden import label
from contactfpga_sim.model.golden.facts import Facts, facts
from contactfpga_sim.model.golden.frame import Divider, Items, Packer, Queue, join
from contactfpga_sim.model.golden.hello import State
from contactfpga_sim.model.golden.link import Link
from contactfpga_sim.model.golden.request import Reception, heard
from contactfpga_sim.model.golden.scan import Scan, last_number
from contactfpga_sim.model.golden.trace import Trace
from contactfpga_sim.model.golden.zones import Departure


class GoldenBoard:
    """The part of :class:`contactfpga_sim.model.board.compiled.CompiledBoard` that a lockstep needs.

    A frame has the cells at the end of a clock run, at most one a step. Zones are the gateware's if cells rest for a
    scan; times differ by up to a scan and a run.
    """

    def __init__(self, skin: Skin):
        """Raise ContactFPGAError for a Skin whose frames depend on more than cells."""
        for name in ("units", "guard", "self_test", "alive"):
            if getattr(skin, name):
                raise ContactFPGAError(f"{name} is {getattr(skin, name)}; golden zones have none: take the gateware")
        self.cycle = 0
        self._facts = facts(skin)
        self._received: list[tuple[int, bytes]] = []
        self._heard = Reception([], [])
        self._line = _Line(self._facts, State(self._facts, [], self._heard))
        self._packer = Packer(
            self._facts, self._line, Divider(self._facts, Trace(0)) if self._facts.divided else Queue()
        )
        self._cells = np.zeros((skin.rows, skin.columns), bool)
        self._began = self._asked = 0
        self._levels: list[tuple[int, int, int]] = []
        self._line.want_hello(0)

    def press(self, cells: np.ndarray) -> None:
        """Press (rows, columns) bool cells from now on."""
        before, self._cells = self._cells, cells & ~self._facts.mask
        if before.any() != self._cells.any():
            self._levels.append((self.cycle, int(self._cells.any()), 0))

    def load(self, readings: object) -> None:
        """Ignored: there are no units."""

    def send(self, data: bytes) -> None:
        known, free = self._facts, 0
        if self._received:
            begun, before = self._received[-1]
            free = begun + 10 * known.bit_clocks * len(before)
        self._received.append((max(self.cycle, free), data))
        now = heard(self._received, known.bit_clocks, bool(known.commands), known.closing)
        for one in now.requests[len(self._heard.requests) :]:
            if one.hello:
                self._line.want_hello(one.cycle + 1)
        self._heard.requests[:], self._heard.numbers[:] = now.requests, now.numbers

    def run(self, cycles: int) -> None:
        """Run clock cycles; a finished scan becomes a frame."""
        self.cycle += cycles
        begun = self.cycle - self._facts.skin.derived.frame_clocks
        if begun >= self._began:
            self._began = self.cycle
            self._packer.take(self._frame(begun))

    def _frame(self, begun: int) -> Items:
        known, cells, requests = self._facts, self._cells, self._heard.requests
        answered = [one for one in requests if one.cycle < begun]
        scan = Scan(
            cells=cells,
            offered=[],
            stuck=0,
            time_us=begun // known.clocks_per_us,
            requested=len(answered) > self._asked,
            heard=last_number(requests, begun) % 8,
            reported=0,
        )
        self._asked = len(answered)
        if known.zones:
            skin = known.skin
            work = label.labelling(cells, skin.connectivity, skin.labeller, skin.closed)
            records = [(self.cycle, self._record(zone)) for zone in work.departures]
        else:
            records = [(self.cycle, int(np.sum(1 << np.flatnonzero(row).astype(object)))) for row in cells]
        return Items(scan, cells, records, self.cycle)

    def _record(self, zone: Departure) -> int:
        known = self._facts
        fields = [(zone.area, known.area_bits), (zone.sum_x, known.sum_x_bits), (zone.sum_y, known.sum_y_bits)]
        fields += [(zone.turned, known.area_bits)] if known.skin.closed else []
        return join((*fields, *zip(zone.extent, known.extent_bits)))[0]

    def take(self, boundary: str) -> np.ndarray:
        """Events of ``contact`` or ``received`` since the last call."""
        if boundary == "contact":
            found, self._levels = self._levels, []
            return np.array(found, EVENT)
        stop = 10 * self._facts.bit_clocks
        return np.array([(cycle + stop, value, 0) for cycle, value in self._line.until(self.cycle - stop)], EVENT)

    def close(self) -> None:
        """Nothing to free."""


class _Line(Link):
    def __init__(self, known: Facts, state: State):
        super().__init__(known, state)

    def until(self, cycle: int) -> list[tuple[int, int]]:
        self.finish(max(0, cycle))
        count = sum(at <= cycle for at, _ in self.bytes)
        found, self.bytes = self.bytes[:count], self.bytes[count:]
        self._blank = [(begin - count, *rest) for begin, *rest in self._blank if begin >= count]  # type: ignore[misc]
        return found
