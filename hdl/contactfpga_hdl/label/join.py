"""Steps to zones: brackets and a stack find the runs of one zone."""

import math
from typing import TYPE_CHECKING

from amaranth.hdl import Array, Cat, Const, Module, Mux, Signal, Value
from amaranth.lib import data, wiring
from amaranth.lib.wiring import In, Out

from contactfpga.skin.derived import Derived
from contactfpga_hdl.label.steps import join_layout, nesting, place_bits, place_of, step_layout, waiting
from contactfpga_hdl.util.stack import Stack

if TYPE_CHECKING:
    from contactfpga_hdl.label.around import Turns


def _marks_layout(derived: Derived) -> data.StructLayout:
    """Runs of the new row, by number, that a step finds to be one zone: ``last`` and the later ``first`` when two
    groups become one, ``onto`` and the step's run ``number`` when that run follows."""
    number = range(_runs(derived))
    back = {"over_back": 1, "onto_back": 1} if derived.skin.closed else {}  # the later one is a turn further back
    return data.StructLayout(
        {
            "over": 1,
            "last": number,
            "first": number,
            "follows": 1,
            "onto": number,
            "number": number,
            "row_done": 1,
            **back,
        }
    )


def _runs(derived: Derived) -> int:
    return max(1, math.ceil(derived.skin.columns / 2))


class Brackets(wiring.Component):
    """Whether runs of a row have an earlier or a later run of their zone in this row.

    enable (in): nothing changes without it.
    marks (in): marks of a step, zeros for none; they count from the next clock.
    passes (in): the run of the row before is passed.
    earlier, later (out): that run has an earlier, or a later, run of its zone in its row.
    turned (out): on a sheet whose ends meet, the run is a turn further back than the earlier one.
    """

    def __init__(self, derived: Derived):
        self.derived = derived
        super().__init__(
            {
                "enable": In(1),
                "marks": In(_marks_layout(derived)),
                "passes": In(1),
                **{name: Out(1) for name in ("earlier", "later", "turned")},
            }
        )

    def elaborate(self, platform):
        m = Module()
        # Marks, a clock later
        late = Signal.like(self.marks)
        over, follows = late.over, late.follows
        found = {
            "earlier": _bit(over, late.first) | _bit(follows, late.number),
            "later": _bit(over, late.last) | _bit(follows, late.onto),
        }
        if self.derived.skin.closed:
            found["turned"] = _bit(late.over_back, late.first) | _bit(late.onto_back, late.number)
        with m.If(self.enable):
            m.d.sync += late.eq(self.marks)
        # A word per mark: of the new row, and of the row before from the run on that is passed next
        for name, bits in found.items():
            known = Signal(_runs(self.derived), name=f"known_{name}")  # bit i for the new row's i-th run
            new = Signal.like(known, name=f"new_{name}")
            old = Signal.like(known, name=f"old_{name}")  # of the row before, from the run on that is passed next
            m.d.comb += [new.eq(known | bits), getattr(self, name).eq(old[0])]
            with m.If(self.enable):
                m.d.sync += known.eq(new)
                with m.If(self.passes):
                    m.d.sync += old.eq(old >> 1)
                with m.If(late.row_done):
                    m.d.sync += [old.eq(new), known.eq(0)]
        return m


def _bit(condition: Value, number: Value) -> Value:
    return Mux(condition, 1 << number, 0)


class Join(wiring.Component):
    """Assigns the new row's runs to zones, and each step's moments to a zone.

    enable (in): nothing changes without it.
    valid, step (in): from the walk.
    lookup (out): place of the stored group that is added, if any.
    join_valid, join (out): one clock after the step.
    """

    def __init__(self, derived: Derived):
        self.derived = derived
        step = step_layout(derived)
        super().__init__(
            {
                "enable": In(1),
                "valid": In(1),
                "step": In(step),
                "lookup": Out(place_bits(derived) + 1),
                "join_valid": Out(1),
                "join": Out(join_layout(derived)),
            }
        )
        self._group_layout = data.StructLayout(
            {
                # zones of the row before with runs to come, and in the first cluster the seam
                "open": range(nesting(derived) + derived.skin.closed + 1),
                "has_run": 1,  # in the new row, and then the numbers of the first and the last one
                "first": range(_runs(derived)),
                "last": range(_runs(derived)),
                "place": range(derived.open_zones),  # of the first one in the table
                # turns of the cluster that is walked, and of the first and the last run; a 1 is a turn back
                **({"turn": 1, "first_turn": 1, "last_turn": 1} if derived.skin.closed else {}),
            }
        )

    def elaborate(self, platform):
        m = Module()
        step = self.step
        m.submodules.stack = stack = Stack(self._group_layout, waiting(self.derived))
        m.submodules.brackets = brackets = Brackets(self.derived)
        works = self.enable & self.valid & ~step.end
        kept = Signal(self._group_layout)  # the group of the cluster being walked
        current = Signal(self._group_layout)
        number = Signal(range(_runs(self.derived)))  # of the step's new run
        # Group of the walked cluster, and the run of the row before
        with m.If(~step.opens):
            m.d.comb += current.eq(kept)
        earlier, later = step.has_before & brackets.earlier, step.has_before & brackets.later
        pop = earlier & (current.open == 0)
        begun = step.has_before & ~earlier  # the first run of its zone
        more, fewer = begun & later, earlier & ~later
        turns = None
        # Turns of a sheet whose ends meet
        if self.derived.skin.closed:
            from contactfpga_hdl.label.around import Turns

            turns = Turns(self.derived)
            with m.If(step.opens):
                m.d.comb += current.open.eq(step.seam)
            m.d.comb += turns.seam.eq(~step.has_before & ~step.has_run)
            pop, fewer = pop | turns.seam & (stack.level != 0), fewer | turns.seam
            turns.find(m, current.turn, earlier, pop, Const(0), brackets.turned)
            turns.keep(m, works & step.has_before, earlier, later)
        # Waiting group that joins, new run, and whether the group waits
        joined = self._take_in(m, current, pop, stack.top, turns)
        group = self._add_run(m, joined, number)
        # Whether the group is open is known before the number of its open zones is.
        stays = Mux(pop, ~(fewer & (stack.top.open == 1)), more | (current.open != 0) & ~(fewer & (current.open == 1)))
        push = step.closes & stays
        m.d.comb += [
            group.open.eq(joined.open + more - fewer),
            stack.enable.eq(works),
            stack.pop.eq(pop),
            stack.push.eq(push),
            stack.entry.eq(group),
            brackets.enable.eq(self.enable),
            brackets.passes.eq(works & step.has_before),
        ]
        with m.If(works):
            m.d.comb += brackets.marks.eq(self._mark(current, pop, stack.top, joined, number, turns))
            m.d.sync += [kept.eq(group), number.eq(Mux(step.row_done, 0, number + step.has_run))]
        # Fate of the zone
        decided = self._decide(m, group, push)
        if turns is not None:
            shares = {"begun": begun, "down": turns.down, "turn": turns.turn, "ring": turns.ring}
            m.d.comb += [decided[name].eq(share) for name, share in shares.items()]
            m.d.comb += decided.first_turn.eq(group.first_turn)
        # Places in the table, of what is loaded and of what is stored
        place, level = Signal(place_bits(self.derived)), Signal(place_bits(self.derived))
        pushed = Signal()  # by the step before
        m.d.comb += [
            place.eq(place_of(self.derived, step.before)),
            level.eq(stack.level),
            self.lookup.eq(Mux(pop, Cat(level, 1), Cat(place, 0))),
            decided.again.eq(pop & pushed),
            decided.load.eq(begun | pop & ~pushed),
        ]
        # A waiting group's place is the number of groups that wait once it does.
        with m.If(push):
            m.d.comb += decided.place.eq(Cat((level + ~pop)[: len(level)], 1))
        if waiting(self.derived):
            with m.If(works):
                m.d.sync += pushed.eq(push)
        with m.If(self.enable):
            m.d.sync += [self.join_valid.eq(self.valid), self.join.eq(decided)]
        return m

    def _take_in(
        self, m: Module, current: data.View, pop: Value, waiting: data.View, turns: "Turns | None"
    ) -> data.View:
        joined = Signal(self._group_layout)
        m.d.comb += joined.eq(current)
        with m.If(pop):
            m.d.comb += [
                joined.open.eq(waiting.open),
                joined.has_run.eq(waiting.has_run | current.has_run),
                joined.first.eq(Mux(waiting.has_run, waiting.first, current.first)),
                joined.last.eq(Mux(current.has_run, current.last, waiting.last)),
                joined.place.eq(Mux(waiting.has_run, waiting.place, current.place)),
            ]
        if turns is not None:
            m.d.comb += joined.turn.eq(turns.turn)
            with m.If(pop):
                first, last = current.first_turn | turns.down, current.last_turn | turns.down
                m.d.comb += [
                    joined.first_turn.eq(Mux(waiting.has_run, waiting.first_turn, first)),
                    joined.last_turn.eq(Mux(current.has_run, last, waiting.last_turn)),
                ]
        return joined

    def _add_run(self, m: Module, joined: data.View, number: Value) -> data.View:
        group = Signal(self._group_layout)
        m.d.comb += group.eq(joined)
        with m.If(self.step.has_run):
            m.d.comb += [
                group.has_run.eq(1),
                group.first.eq(Mux(joined.has_run, joined.first, number)),
                group.last.eq(number),
                group.place.eq(Mux(joined.has_run, joined.place, place_of(self.derived, self.step.start))),
            ]
            if self.derived.skin.closed:
                first = Mux(joined.has_run, joined.first_turn, joined.turn)
                m.d.comb += [group.first_turn.eq(first), group.last_turn.eq(joined.turn)]
        return group

    def _mark(
        self,
        current: data.View,
        pop: Value,
        waiting: data.View,
        joined: data.View,
        number: Value,
        turns: "Turns | None",
    ) -> Value:
        layout = _marks_layout(self.derived)
        over = pop & waiting.has_run & current.has_run  # two groups of runs become one
        follows = self.step.has_run & joined.has_run  # the new run follows one of its zone
        marks = {
            "over": over,
            "last": waiting.last,
            "first": current.first,
            "follows": follows,
            "onto": joined.last,
            "number": number,
            "row_done": self.step.row_done,
        }
        if turns is not None:
            marks["over_back"] = over & (current.first_turn | turns.down) & ~waiting.last_turn
            marks["onto_back"] = follows & joined.turn & ~joined.last_turn
        return Cat(marks[name] for name in layout.members)

    def _decide(self, m: Module, group: data.View, push: Value) -> data.View:
        step = self.step
        closed = step.closes & ~push
        decided = Signal(self.join.shape())
        m.d.comb += [
            decided.end.eq(step.end),
            decided.closes.eq(step.closes),
            decided.store.eq(push | closed & group.has_run),
            decided.leaves.eq(step.end | closed & (step.final | ~group.has_run)),
            decided.place.eq(group.place),
        ]
        with m.If(step.has_run):
            m.d.comb += self._run_moments(m, decided.run)
        return decided

    def _run_moments(self, m: Module, run: data.View) -> list:
        """Moments of the new run, whose column sum is a difference of triangular numbers, and its extent."""
        step = self.step
        extent = {}
        if self.derived.skin.extent:
            from contactfpga_hdl.label.extent import extent_of_run

            extent = extent_of_run(self.derived, step.start, step.past - 1, step.y)
        below = Array(math.comb(column, 2) for column in range(self.derived.skin.columns + 1))
        return [
            run.area.eq(step.area),
            run.sum_x.eq(below[step.past] - below[step.start]),
            run.sum_y.eq(step.area * step.y),
            *(run[name].eq(field) for name, field in extent.items()),
        ]
