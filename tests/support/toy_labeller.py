"""A labeller of your own in one file: each row with a pressed cell is a zone. Nothing else in the project knows it."""

import numpy as np
from amaranth.hdl import Module, Mux, Signal
from amaranth.lib import wiring

from contactfpga.choices.labellers import Labeller
from contactfpga_hdl.payloads import labeller_ports, row_number
from contactfpga_sim.model.golden.zones import Departure, LabellerRule, Labelling

TOY = Labeller(
    name="toy_labeller:TOY",
    title="toy",
    gateware="toy_labeller:RowLabeller",
    golden="toy_labeller:RULE",
    exact=False,
    end_clocks=lambda derived: 2,
    row_clocks=lambda derived: 3,
    empty_row_clocks=lambda derived: 2,
)


class RowLabeller(wiring.Component):
    """A row handed over in clock h leaves as a zone in clock h + 1; the end mark comes a clock after the last one."""

    def __init__(self, skin):
        self.derived = skin.derived
        super().__init__(labeller_ports(self.derived))

    def elaborate(self, platform):
        m = Module()
        row, record = self.rows.payload, self.records.payload
        y, cells, pending, ends = Signal(range(64)), Signal.like(row.cells), Signal(), Signal()
        taken = self.rows.valid & self.rows.ready
        number = row_number(m, self.derived, row, taken)
        area = sum(cells[x] for x in range(len(cells)))
        m.d.comb += [
            self.rows.ready.eq(~pending & ~ends),
            self.records.valid.eq(pending | ends),
            record.end.eq(~pending),
            record.zone.area.eq(Mux(pending, area, 0)),
            record.zone.sum_x.eq(Mux(pending, sum(cells[x] * x for x in range(len(cells))), 0)),
            record.zone.sum_y.eq(Mux(pending, area * y, 0)),
        ]
        with m.If(self.records.valid & self.records.ready):
            m.d.sync += [pending.eq(0), ends.eq(pending & ends)]
        with m.If(taken):
            m.d.sync += [
                cells.eq(row.cells),
                y.eq(number),
                pending.eq(row.cells.any()),
                ends.eq(row.last),
            ]
        return m


def _work(cells: np.ndarray, connectivity: int) -> Labelling:
    pressed = [bool(row.any()) for row in cells]
    last = len(cells) - 1
    departures = []
    for y, row in enumerate(cells):
        x = np.flatnonzero(row)
        if len(x):
            departures.append(Departure(y, 1, len(x), int(x.sum()), y * len(x)))
    busy = tuple(1 + one + (y == last) for y, one in enumerate(pressed))
    return Labelling(busy, 1 + pressed[last], tuple(departures))


RULE = LabellerRule(_work)
