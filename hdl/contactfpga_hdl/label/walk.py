"""Two adjacent rows, cut into steps."""

from amaranth.hdl import Cat, Const, Module, Mux, Signal
from amaranth.lib import stream, wiring
from amaranth.lib.wiring import In, Out

from contactfpga.skin.derived import Derived
from contactfpga_hdl.label.steps import step_layout
from contactfpga_hdl.payloads import row_layout


def _split(m, bits):
    """The lowest bit that is set, alone, and the others."""
    lowest, others = Signal.like(bits), Signal.like(bits)
    m.d.comb += [others.eq(bits & (bits - 1)), lowest.eq(bits & ~others)]
    return lowest, others


def _index(one_hot, width):
    """Number of the bit that is set."""
    return Cat(
        Cat(one_hot[i] for i in range(len(one_hot)) if i >> bit & 1).any() if len(one_hot) > 1 else Const(0, 1)
        for bit in range(width)
    )


class Walk(wiring.Component):
    """Cuts two adjacent rows into steps, one a clock while ``enable`` is high."""

    def __init__(self, derived: Derived):
        self.derived = derived
        step = step_layout(derived)
        super().__init__(
            {
                "rows": In(stream.Signature(row_layout(derived))),
                "enable": In(1),
                "step_valid": Out(1),
                "step": Out(step),
            }
        )

    def elaborate(self, platform):
        m = Module()
        columns = self.derived.skin.columns
        # Columns still to be walked: where runs start and stop, and where clusters behind the first one end.
        self._befores = Signal(columns)
        self._starts = Signal(columns)
        self._stops = Signal(columns)
        self._ends = Signal(columns)
        self._inside = Signal(columns)  # all columns up to the end of the first cluster; none: no work
        self._last = Signal()
        self._y = Signal(self.step.y.shape())
        self._walk_clusters(m)
        self._take_row(m)
        return m

    def _walk_clusters(self, m):
        work = self._inside[0]
        inside = self._inside
        before, befores_left = _split(m, self._befores)
        start, starts_left = _split(m, self._starts)
        stop, stops_left = _split(m, self._stops)
        has_before = (self._befores & inside).any()
        has_run = (self._starts & inside).any()
        closes = Signal()
        opens = Signal(init=1)
        step = Signal.like(self.step)
        m.d.comb += [
            closes.eq(~(befores_left & inside).any() & ~(starts_left & inside).any()),
            step.end.eq(~work),
            step.has_before.eq(has_before),
            step.before.eq(_index(before, len(step.before))),
            step.has_run.eq(has_run),
            step.start.eq(_index(start, len(step.start))),
            step.stop.eq(_index(stop, len(step.stop))),
            step.opens.eq(opens),
            step.closes.eq(closes),
            step.row_done.eq(closes & ~self._ends.any()),
            step.y.eq(self._y),
            step.final.eq(self._last),
        ]
        with m.If(self.enable):
            m.d.sync += [self.step.eq(step), self.step_valid.eq(work | self._last)]
        with m.If(self.enable & work):
            m.d.sync += opens.eq(closes)
            with m.If(has_before):
                m.d.sync += self._befores.eq(befores_left)
            with m.If(has_run):
                m.d.sync += [self._starts.eq(starts_left), self._stops.eq(stops_left)]
            with m.If(closes):
                self._next_cluster(m, self._ends)

    def _take_row(self, m):
        row = self.rows.payload
        before = Signal.like(row.cells)  # the row last taken, empty before a frame
        y_next = Signal.like(self._y)
        work = self._inside[0]
        with m.If(self.enable & ~work):
            m.d.sync += self._last.eq(0)  # its end mark is on its way
        m.d.comb += self.rows.ready.eq(self.enable & ~work)
        with m.If(self.rows.valid & self.rows.ready):
            right_row, right_before = row.cells >> 1, before >> 1
            if self.derived.skin.connectivity == 8:
                joined = (row.cells | before) & (right_row | right_before)
            else:
                joined = row.cells & right_row | before & right_before
            m.d.sync += [
                self._befores.eq(before & ~(before << 1)),
                self._starts.eq(row.cells & ~(row.cells << 1)),
                self._stops.eq(row.cells & ~right_row),
                self._last.eq(row.last),
                self._y.eq(y_next),
                before.eq(Mux(row.last, 0, row.cells)),
                y_next.eq(Mux(row.last, 0, y_next + 1)),
            ]
            ends = Signal(len(joined))
            m.d.comb += ends.eq((row.cells | before) & ~joined)
            self._next_cluster(m, ends)

    def _next_cluster(self, m, ends):
        """Of the clusters that end there, the first one is next."""
        upto, others = Signal.like(self._ends), Signal.like(self._ends)
        m.d.comb += [others.eq(ends & (ends - 1)), upto.eq(Mux(ends.any(), ends ^ (ends - 1), 0))]
        m.d.sync += [self._ends.eq(others), self._inside.eq(upto)]
