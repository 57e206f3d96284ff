"""Two adjacent rows cut into steps, with layouts and sizes."""

import math

from amaranth.hdl import Cat, Const, Module, Mux, Signal, Value
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from contactfpga.skin.derived import Derived
from contactfpga_hdl.payloads import moments_layout, row_layout, row_number


def step_layout(derived: Derived) -> data.StructLayout:
    """One step of the walk: at most one run of the row before and one of the new row, in one cluster.

    A step without a run is the seam's: the last cluster continues in the first.
    """
    column = max(1, (derived.skin.columns - 1).bit_length())
    return data.StructLayout(
        {
            "end": 1,  # no step: the mark after a frame
            "has_before": 1,
            "before": column,  # start of the run in the row before
            "has_run": 1,
            "start": column,  # first column of the new run, the one past its last, and how many they are
            "past": range(derived.skin.columns + 1),
            "area": range(derived.skin.columns + 1),
            "opens": 1,  # first and last step of a cluster
            "closes": 1,
            "row_done": 1,  # last step of a row
            "y": max(1, (derived.skin.rows - 1).bit_length()),
            "final": 1,  # no row follows in this frame
            **({"seam": 1} if derived.skin.closed else {}),  # opens the first cluster, which goes on from the last
        }
    )


def join_layout(derived: Derived) -> data.StructLayout:
    """A step's addition to its zone, and the zone's fate."""
    turns = {"begun": 1, "down": 1, "turn": 1, "ring": 1, "first_turn": 1}  # docs/labelling.md#around-a-cylinder
    return data.StructLayout(
        {
            "end": 1,
            "closes": 1,  # the next step starts from nothing
            "run": data.StructLayout(moments_layout(derived).members | extent_of(derived)),  # of the new run, to add
            "load": 1,  # add the group that was looked up
            "again": 1,  # add the group that the step before stored
            "store": 1,  # put what there is in ``place``
            "place": place_bits(derived) + 1,
            "leaves": 1,
            **(turns if derived.skin.closed else {}),
        }
    )


def nesting(derived: Derived) -> int:
    """The most zones with a run passed and a run to come."""
    return math.ceil(derived.skin.columns / 2) // 2


def waiting(derived: Derived) -> int:
    """The most waiting groups: one for each such zone; on a sheet whose ends meet, one of them for the last cluster."""
    if not derived.skin.closed:
        return nesting(derived)
    columns = derived.skin.columns
    return (columns + 3) // 4 if derived.skin.connectivity == 8 else columns // 4 + 1


def place_bits(derived: Derived) -> int:
    """Bits of a place in each half of the table: of zones in the row before, and of waiting groups."""
    return max(1, (derived.open_zones - 1).bit_length(), waiting(derived).bit_length())


def place_of(derived: Derived, column: Value) -> Value:
    """Place of the moments of a zone whose run starts at ``column``."""
    return column >> 1 if derived.skin.connectivity == 8 else column


def _without_lowest(m: Module, bits: Value) -> Value:
    others = Signal.like(bits, name_suffix="_others")
    m.d.comb += others.eq(bits & (bits - 1))
    return others


def _index(one_hot: Value, width: int) -> Value:
    return Cat(
        Cat(one_hot[i] for i in range(len(one_hot)) if i >> bit & 1).any() if len(one_hot) > 1 else Const(0, 1)
        for bit in range(width)
    )


def kept_layout(derived: Derived) -> data.StructLayout:
    """Stored data of a group of cells: moments, on a sheet whose ends meet their turns, and an extent."""
    turned = turned_layout(derived) if derived.skin.closed else {}
    return data.StructLayout(moments_layout(derived).members | turned | extent_of(derived))


def extent_of(derived: Derived) -> dict[str, int]:
    """Stored fields of an extent, if the Skin has one."""
    if not derived.skin.extent:
        return {}
    from contactfpga_hdl.label.extent import stored_extent

    return stored_extent(derived)


def zone_of(derived: Derived, group: data.View) -> Value:
    zone = [group[name] for name in moments_layout(derived).members]
    if derived.skin.closed:
        wound = group.wound.replicate(len(group.turned))
        zone.append(Mux(group.ring, group.area, group.turned | wound))
    if derived.skin.extent:
        from contactfpga_hdl.label.extent import sent_extent

        zone.append(sent_extent(derived, group))
    return Cat(zone)


def turned_layout(derived: Derived) -> dict[str, int]:
    return {
        "turned": derived.area_bits,  # cells on the upper of two turns
        "two": 1,  # there are cells on two turns
        "back": 1,  # the lower one is not that of the first cluster, or of a zone's first run, but the one before it
        "wound": 1,
        "ring": 1,
    }


def over_the_seam(derived: Derived, row: Value, before: Value) -> Value:
    """Whether cells in the last and first columns of two rows are joined."""
    if derived.skin.connectivity == 8:
        return (row | before)[-1] & (row | before)[0]
    return row[-1] & row[0] | before[-1] & before[0]


class _Left:
    """The part of two rows still to be walked.

    An edge is the first column of a run or the one past its last: the new row's runs in one word. Words without the
    lowest bits are in registers, so that no clock finds a bit and then decides with it.
    """

    def __init__(self, derived: Derived):
        columns = derived.skin.columns
        self.befores = Signal(columns)  # where runs of the row before start
        self.befores_later = Signal(columns)  # without the first one
        self.edges = Signal(columns + 1)
        self.edges_stop = Signal(columns + 1)  # without the first run's start
        self.edges_later = Signal(columns + 1)  # without the first run
        self.inside = Signal(columns)  # all columns up to the end of the first cluster
        self.ends = Signal(columns)  # where the clusters after that one end
        self.found = Signal()  # a row with clusters was taken; the first one is next
        self.work = Signal()  # there is a first cluster
        self.last = Signal()  # the new row is the frame's last one
        self.seam = Signal()  # the last cluster goes on in the first one
        self.first = Signal()  # the cluster is the first one
        self.y = Signal(step_layout(derived)["y"].shape)


class Walk(wiring.Component):
    """Cuts two adjacent rows into steps, one per clock while ``enable`` is high.

    rows (in): taken when the row before is cut; the first step is cut two clocks later.
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
        inside = left.inside
        has_before = (left.befores & inside).any()
        has_run = (left.edges & inside).any()
        closes = Signal()
        opens = Signal(init=1)
        step = Signal.like(self.step)
        start = _index((left.edges & ~left.edges_stop)[:-1], len(step.start))
        past = _index(left.edges_stop & ~left.edges_later, len(step.past))
        m.d.comb += [
            closes.eq(~((left.befores_later | left.edges_later) & inside).any()),
            step.end.eq(~left.work),
            step.has_before.eq(has_before),
            step.before.eq(_index(left.befores & ~left.befores_later, len(step.before))),
            step.has_run.eq(has_run),
            step.start.eq(start),
            step.past.eq(past),
            step.area.eq(past - start),
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
        # What is left, without this step's runs, or without the cluster that ends
        edges_stop = _without_lowest(m, left.edges_later)
        with m.If(self.enable):
            m.d.sync += [self.step.eq(step), self.step_valid.eq(left.work | left.last & ~left.found), left.found.eq(0)]
            with m.If(left.work):
                m.d.sync += opens.eq(closes)
            with m.If(left.found | left.work & has_before):
                m.d.sync += [
                    left.befores.eq(left.befores_later),
                    left.befores_later.eq(_without_lowest(m, left.befores_later)),
                ]
            with m.If(left.found | left.work & has_run):
                m.d.sync += [
                    left.edges.eq(left.edges_later),
                    left.edges_stop.eq(edges_stop),
                    left.edges_later.eq(_without_lowest(m, edges_stop)),
                ]
            with m.If(left.found | left.work & closes):
                upto = Signal.like(left.ends)
                m.d.comb += upto.eq(left.ends ^ (left.ends - 1))
                m.d.sync += [
                    left.work.eq(left.ends.any()),
                    left.inside.eq(upto),
                    left.ends.eq(left.ends & ~upto),
                    left.first.eq(left.found),
                ]

    def _take_row(self, m: Module, left: _Left) -> None:
        row = self.rows.payload
        before = Signal.like(row.cells)  # the row last taken, empty before a frame
        idle = ~left.work & ~left.found
        with m.If(self.enable & idle):
            m.d.sync += left.last.eq(0)  # its end mark is on its way
        m.d.comb += self.rows.ready.eq(self.enable & idle)
        taken = self.rows.valid & self.rows.ready
        y = row_number(m, self.derived, row, taken)
        with m.If(taken):
            right_row, right_before = row.cells >> 1, before >> 1
            if self.derived.skin.connectivity == 8:
                joined = (row.cells | before) & (right_row | right_before)
            else:
                joined = row.cells & right_row | before & right_before
            m.d.sync += [
                left.befores_later.eq(before & ~(before << 1)),
                left.edges_later.eq(row.cells ^ (row.cells << 1)),
                left.ends.eq((row.cells | before) & ~joined),
                left.found.eq((row.cells | before).any()),
                left.last.eq(row.last),
                left.y.eq(y),
                before.eq(Mux(row.last, 0, row.cells)),
            ]
            if self.derived.skin.closed:
                m.d.sync += left.seam.eq(over_the_seam(self.derived, row.cells, before))
