"""Steps to zones: runs of one zone, found by brackets and a stack."""

import math
from typing import TYPE_CHECKING

from amaranth.hdl import Array, Const, Module, Mux, Signal, Value
from amaranth.lib import data, wiring
from amaranth.lib.wiring import In, Out

from contactfpga.skin.derived import Derived
from contactfpga_hdl.label.steps import join_layout, nesting, place_of, step_layout, waiting
from contactfpga_hdl.util.stack import Stack

if TYPE_CHECKING:
    from contactfpga_hdl.label.around import Turns


class _Brackets:
    """New-row runs with a later or earlier run of the same zone, bit i for the i-th."""

    def __init__(self, runs: int):
        self.after = Signal(runs)  # as known so far
        self.before = Signal(runs)
        self.new_after = Signal(runs)  # with this step
        self.new_before = Signal(runs)
        self.turned = Signal(runs)  # a turn further back than that earlier one
        self.new_turned = Signal(runs)
        self.number = Signal(range(runs))  # of the step's new run


class Join(wiring.Component):
    """Assigns the new row's runs to zones, and each step's moments to a zone.

    enable (in): nothing changes without it.
    valid, step (in): from the walk.
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
                "join_valid": Out(1),
                "join": Out(join_layout(derived)),
            }
        )
        self._runs = max(1, math.ceil(derived.skin.columns / 2))  # the most a row can hold
        self._group_layout = data.StructLayout(
            {
                # zones of the row before with runs to come, and in the first cluster the seam
                "open": range(nesting(derived) + derived.skin.closed + 1),
                "has_run": 1,  # in the new row, and then the numbers of the first and the last one
                "first": range(self._runs),
                "last": range(self._runs),
                "place": range(derived.open_zones),  # of the first one in the table
                # turns of the cluster that is walked, and of the first and the last run; a 1 is a turn back
                **({"turn": 1, "first_turn": 1, "last_turn": 1} if derived.skin.closed else {}),
            }
        )

    def elaborate(self, platform):
        m = Module()
        m.submodules.stack = stack = Stack(self._group_layout, waiting(self.derived))
        works = self.enable & self.valid & ~self.step.end
        kept = Signal(self._group_layout)  # the group of the cluster being walked
        current = Signal(self._group_layout)
        with m.If(~self.step.opens):
            m.d.comb += current.eq(kept)
        known = _Brackets(self._runs)
        earlier, later, turned = self._brackets(m, works, known)
        pop = self.step.has_before & earlier & (current.open == 0)
        turns = None
        if self.derived.skin.closed:
            from contactfpga_hdl.label.around import Turns

            turns = Turns(self.derived)
            with m.If(self.step.opens):
                m.d.comb += current.open.eq(self.step.seam)
            m.d.comb += turns.seam.eq(~self.step.has_before & ~self.step.has_run)
            pop = pop | turns.seam & (stack.level != 0)
            turns.find(m, current.turn, self.step.has_before & earlier, pop, Const(0), turned)
            turns.keep(m, works & self.step.has_before, earlier, later)
        passed = self.step.has_before & ~later  # the last run of its zone
        begun = self.step.has_before & ~earlier  # the first one
        joined = self._take_in(m, current, pop, stack.top, turns)
        group = self._add_run(m, joined, known.number)
        ended = passed & earlier if turns is None else passed & earlier | turns.seam
        m.d.comb += [
            group.open.eq(joined.open + (self.step.has_before & ~earlier & later) - ended),
            stack.enable.eq(works),
            stack.pop.eq(pop),
            stack.push.eq(self.step.closes & (group.open != 0)),
            stack.entry.eq(group),
        ]
        self._mark(m, known, current, pop, stack.top, joined, turns)
        decided = self._decide(m, group, pop, begun)
        if turns is not None:
            shares = {"down": turns.down, "turn": turns.turn, "ring": turns.ring, "first_turn": group.first_turn}
            m.d.comb += [decided[name].eq(share) for name, share in shares.items()]
        with m.If(works):
            m.d.sync += kept.eq(group)
        with m.If(self.enable):
            m.d.sync += [self.join_valid.eq(self.valid), self.join.eq(decided)]
        return m

    def _brackets(self, m: Module, works: Value, known: _Brackets) -> tuple[Value, Value, Value]:
        """Whether the step's run of the row before has an earlier, or later, run of its zone in its row, and whether it
        is a turn further back than the earlier one.

        Bit i belongs to the row's i-th run; those of the row before shift down as its runs are passed.
        """
        old_after = Signal(self._runs)  # runs after one of the same zone
        old_before = Signal(self._runs)  # runs before one of the same zone
        old_turned = Signal(self._runs)
        with m.If(works):
            m.d.sync += [
                known.after.eq(known.new_after),
                known.before.eq(known.new_before),
                known.number.eq(known.number + self.step.has_run),
            ]
            with m.If(self.step.has_before):
                m.d.sync += [old_after.eq(old_after >> 1), old_before.eq(old_before >> 1)]
            with m.If(self.step.row_done):
                m.d.sync += [
                    old_after.eq(known.new_after),
                    old_before.eq(known.new_before),
                    known.after.eq(0),
                    known.before.eq(0),
                    known.number.eq(0),
                ]
        if self.derived.skin.closed:
            with m.If(works):
                m.d.sync += known.turned.eq(known.new_turned)
                with m.If(self.step.has_before):
                    m.d.sync += old_turned.eq(old_turned >> 1)
                with m.If(self.step.row_done):
                    m.d.sync += [old_turned.eq(known.new_turned), known.turned.eq(0)]
        return old_after[0], old_before[0], old_turned[0]

    def _take_in(
        self, m: Module, current: data.View, pop: Value, waiting: data.View, turns: "Turns | None"
    ) -> data.View:
        """The current group, merged with the one on the stack if the run before continues it."""
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
        m: Module,
        known: _Brackets,
        current: data.View,
        pop: Value,
        waiting: data.View,
        joined: data.View,
        turns: "Turns | None",
    ) -> None:
        """Set the brackets of new-row runs now known to be of one zone."""
        over = pop & waiting.has_run & current.has_run  # two groups of runs become one
        onto = self.step.has_run & joined.has_run  # the new run follows one of its zone

        def bit(condition: Value, number: Value) -> Value:
            return Mux(condition, 1 << number, 0)

        m.d.comb += [
            known.new_before.eq(known.before | bit(over, waiting.last) | bit(onto, joined.last)),
            known.new_after.eq(known.after | bit(over, current.first) | bit(onto, known.number)),
        ]
        if turns is not None:
            over_back = over & (current.first_turn | turns.down) & ~waiting.last_turn
            onto_back = onto & joined.turn & ~joined.last_turn
            back = bit(over_back, current.first) | bit(onto_back, known.number)
            m.d.comb += known.new_turned.eq(known.turned | back)

    def _decide(self, m: Module, group: data.View, pop: Value, begun: Value) -> data.View:
        step = self.step
        closed = step.closes & (group.open == 0)
        decided = Signal(self.join.shape())
        m.d.comb += [
            decided.end.eq(step.end),
            decided.closes.eq(step.closes),
            decided.pop.eq(pop),
            decided.load.eq(begun),
            decided.push.eq(step.closes & (group.open != 0)),
            decided.store.eq(closed & group.has_run),
            decided.leaves.eq(step.end | closed & (step.final | ~group.has_run)),
            decided.place.eq(group.place),
        ]
        with m.If(step.has_run):
            m.d.comb += self._run_moments(m, decided.run)
        return decided

    def _run_moments(self, m: Module, run: data.View) -> list:
        """Moments of the new run; the column sum is a difference of triangular numbers."""
        start, stop = self.step.start, self.step.stop
        columns = self.derived.skin.columns
        up_to = Array(math.comb(column + 1, 2) for column in range(columns))
        below = Array(math.comb(column, 2) for column in range(columns))
        length = Signal(range(columns + 1))
        m.d.comb += length.eq(stop - start + 1)
        return [
            run.area.eq(length),
            run.sum_x.eq(up_to[stop] - below[start]),
            run.sum_y.eq(length * self.step.y),
        ]
