"""Cells past the seam, where a sheet's ends meet: columns are counted on, over two adjacent turns.

A group's cells lie on the turn of its first cluster and on one of the turns beside it, the next one or the one *back*;
``turned`` counts those on the upper one of the two. When groups become one, what lay on a turn of its own is counted
with the turn where it lies now. A group that needs a third turn is ``wound``.
"""

from amaranth.hdl import Cat, Elaboratable, Module, Mux, Signal, Value
from amaranth.lib import data

from contactfpga.skin.derived import Derived
from contactfpga_hdl.label.steps import join_layout
from contactfpga_hdl.payloads import moments_layout


def turned_layout(derived: Derived) -> dict[str, int]:
    """What is known of a group's cells besides their moments."""
    return {
        "turned": derived.area_bits,  # cells on the upper of two turns
        "two": 1,  # there are cells on two turns
        "back": 1,  # the lower one is not that of the first cluster, or of a zone's first run, but the one before it
        "wound": 1,
        "ring": 1,
    }


def kept_layout(derived: Derived) -> data.StructLayout:
    """What a labeller keeps of a group of cells: moments, and where a sheet's ends meet their turns."""
    turned = turned_layout(derived) if derived.skin.closed else {}
    return data.StructLayout(moments_layout(derived).members | turned)


def zone_of(derived: Derived, group: data.View) -> Value:
    """The zone record of a complete group."""
    moments = Cat(group[name] for name in moments_layout(derived).members)
    if not derived.skin.closed:
        return moments
    wound = group.wound.replicate(len(group.turned))
    return Cat(moments, Mux(group.ring, group.area, group.turned | wound))


class Unwrap(Elaboratable):
    """The turns of a group after a step.

    join (in): the step. kept, waiting, loaded (in): the group before it, and what joins it.
    group (out): the group after it.
    """

    def __init__(self, derived: Derived):
        kept = kept_layout(derived)
        self.join = Signal(join_layout(derived))
        self.kept, self.waiting, self.loaded = (Signal(kept, name=name) for name in ("kept", "waiting", "loaded"))
        self.group = Signal(data.StructLayout(turned_layout(derived)))

    def elaborate(self, platform):
        m = Module()
        join, kept, group = self.join, self.kept, self.group
        found, adds = Signal.like(self.kept), join.pop | join.load
        m.d.comb += found.eq(Mux(join.pop, self.waiting, Mux(join.load, self.loaded, 0)))
        # A turn back, or two, from the group's first cluster: the lower turn of what there was and of what joins it.
        moved = join.load & join.turn
        kept_back, found_back = kept.back | join.down, adds & (found.back | moved)
        too_far = kept.back & join.down | adds & found.back & moved
        back = kept_back | found_back | join.turn
        kept_above, found_above, run_above = back & ~kept_back, adds & back & ~found_back, back & ~join.turn
        shares = (
            Mux(kept_above, kept.area, kept.turned),
            Mux(found_above, found.area, found.turned),
            Mux(run_above, join.run.area, 0),
        )
        m.d.comb += [
            group.back.eq(back),
            group.two.eq(kept.two | found.two | kept_above | found_above | run_above),
            group.turned.eq((shares[0] + shares[2]) + shares[1]),
            group.wound.eq(kept.wound | found.wound | too_far | kept_above & kept.two | found_above & found.two),
            group.ring.eq(kept.ring | found.ring | join.ring),
        ]
        return m
