"""Two adjacent rows, cut into steps."""

from amaranth.hdl import Cat, Const, Module, Mux, Signal, Value
from amaranth.lib import stream, wiring
from amaranth.lib.wiring import In, Out

from contactfpga.skin.derived import Derived
from contactfpga_hdl.label.steps import step_layout
from contactfpga_hdl.payloads import row_layout
from contactfpga_hdl.util.row_number import row_number


def _split(m: Module, bits: Value) -> tuple[Value, Value]:
    """The lowest bit that is set, alone, and the others."""
    lowest, others = Signal.like(bits), Signal.like(bits)
    m.d.comb += [others.eq(bits & (bits - 1)), lowest.eq(bits & ~others)]
    return lowest, others


def _index(one_hot: Value, width: int) -> Value:
    """Number of the bit that is set."""
    return Cat(
        Cat(one_hot[i] for i in range(len(one_hot)) if i >> bit & 1).any() if len(one_hot) > 1 else Const(0, 1)
        for bit in range(width)
    )


class _Left:
    """What of two rows is still to be walked."""

    def __init__(self, derived: Derived):
        columns = derived.skin.columns
        self.befores = Signal(columns)  # where runs of the row before start
        self.starts = Signal(columns)  # where runs of the new row start and stop
        self.stops = Signal(columns)
        self.inside = Signal(columns)  # all columns up to the end of the first cluster; none: no work
        self.ends = Signal(columns)  # where the clusters after that one end
        self.last = Signal()  # the new row is the frame's last one
        self.seam = Signal()  # the last cluster goes on in the first one
        self.first = Signal()  # the cluster is the first one
        self.y = Signal(step_layout(derived)["y"].shape)


class Walk(wiring.Component):
    """Cuts two adjacent rows into steps, one per clock while ``enable`` is high.

    rows (in): taken when the one before is cut.
    step_valid, step (out): one clock after the step is cut.
    """

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
        left = _Left(self.derived)
        self._walk_clusters(m, left)
        self._take_row(m, left)
        return m

    def _walk_clusters(self, m: Module, left: _Left) -> None:
        work = left.inside[0]
        inside = left.inside
        before, befores_left = _split(m, left.befores)
        start, starts_left = _split(m, left.starts)
        stop, stops_left = _split(m, left.stops)
        has_before = (left.befores & inside).any()
        has_run = (left.starts & inside).any()
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
            step.row_done.eq(closes & ~left.ends.any()),
            step.y.eq(left.y),
            step.final.eq(left.last),
        ]
        if self.derived.skin.closed:  # the last cluster has one more step, without any run
            m.d.comb += step.seam.eq(left.seam & left.first)
            with m.If(left.seam & ~left.ends.any() & (has_before | has_run)):
                m.d.comb += closes.eq(0)
        with m.If(self.enable):
            m.d.sync += [self.step.eq(step), self.step_valid.eq(work | left.last)]
        with m.If(self.enable & work):
            m.d.sync += opens.eq(closes)
            with m.If(has_before):
                m.d.sync += left.befores.eq(befores_left)
            with m.If(has_run):
                m.d.sync += [left.starts.eq(starts_left), left.stops.eq(stops_left)]
            with m.If(closes):
                if self.derived.skin.closed:
                    m.d.sync += left.first.eq(0)
                self._next_cluster(m, left, left.ends)

    def _take_row(self, m: Module, left: _Left) -> None:
        row = self.rows.payload
        before = Signal.like(row.cells)  # the row last taken, empty before a frame
        work = left.inside[0]
        with m.If(self.enable & ~work):
            m.d.sync += left.last.eq(0)  # its end mark is on its way
        m.d.comb += self.rows.ready.eq(self.enable & ~work)
        taken = self.rows.valid & self.rows.ready
        y = row_number(m, self.derived, row, taken)
        with m.If(taken):
            right_row, right_before = row.cells >> 1, before >> 1
            if self.derived.skin.connectivity == 8:
                joined = (row.cells | before) & (right_row | right_before)
            else:
                joined = row.cells & right_row | before & right_before
            m.d.sync += [
                left.befores.eq(before & ~(before << 1)),
                left.starts.eq(row.cells & ~(row.cells << 1)),
                left.stops.eq(row.cells & ~right_row),
                left.last.eq(row.last),
                left.y.eq(y),
                before.eq(Mux(row.last, 0, row.cells)),
            ]
            if self.derived.skin.closed:
                m.d.sync += [left.seam.eq(self._over_the_seam(row.cells, before)), left.first.eq(1)]
            row_ends = Signal(len(joined))
            m.d.comb += row_ends.eq((row.cells | before) & ~joined)
            self._next_cluster(m, left, row_ends)

    def _over_the_seam(self, row: Value, before: Value) -> Value:
        """Whether a cell in the last column is joined with one in the first."""
        if self.derived.skin.connectivity == 8:
            return (row | before)[-1] & (row | before)[0]
        return row[-1] & row[0] | before[-1] & before[0]

    def _next_cluster(self, m: Module, left: _Left, ends: Value) -> None:
        """Of the clusters that end there, the first one is next."""
        upto, others = Signal.like(left.ends), Signal.like(left.ends)
        m.d.comb += [others.eq(ends & (ends - 1)), upto.eq(Mux(ends.any(), ends ^ (ends - 1), 0))]
        m.d.sync += [left.ends.eq(others), left.inside.eq(upto)]
