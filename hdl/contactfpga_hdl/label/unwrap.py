"""Cells past the seam, where a sheet's ends meet: columns are counted on, over two adjacent turns.

A group's cells lie on the turn of its first cluster and on one of the turns beside it, the next one or the one *back*;
``turned`` counts those on the upper one of the two. When groups become one, what lay on a turn of its own is counted
with the turn where it lies now. A group that needs a third turn is ``wound``.
"""

from amaranth.hdl import Cat, Elaboratable, Module, Mux, Signal, Value
from amaranth.lib import data

from contactfpga.skin.derived import Derived
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
    """The turns of a group that cells, and what was found for it, are added to.

    kept, down (in): the group so far, and whether all of it is now known to lie a turn back.
    found, joins, zone (in): what joins it, if anything does: a zone of the row before, or a group that waited, which
    gives the group its first cluster; all zeros if nothing does.
    turn, cells (in): of the cluster that is walked, and how many of its cells are new.
    ring (in): this makes the group a ring.
    group (out): the group then.
    """

    def __init__(self, derived: Derived):
        self.kept, self.found = (Signal(kept_layout(derived), name=f"turned_{name}") for name in ("kept", "found"))
        self.down, self.joins, self.zone, self.turn, self.ring = (
            Signal(name=f"turned_{name}") for name in ("down", "joins", "zone", "turn", "ring")
        )
        self.cells = Signal(derived.area_bits, name="turned_cells")
        self.group = Signal(data.StructLayout(turned_layout(derived)), name="turned_group")

    def elaborate(self, platform):
        m = Module()
        kept, found, group = self.kept, self.found, self.group
        # A turn back, or two, from the group's first cluster: the lower turn of what there was and of what joins it.
        moved = self.zone & self.turn
        kept_back, found_back = kept.back | self.down, self.joins & (found.back | moved)
        too_far = kept.back & self.down | self.joins & found.back & moved
        back = kept_back | found_back | self.turn
        kept_above, found_above, cells_above = back & ~kept_back, self.joins & back & ~found_back, back & ~self.turn
        shares = (
            Mux(kept_above, kept.area, kept.turned),
            Mux(found_above, found.area, found.turned),
            Mux(cells_above, self.cells, 0),
        )
        m.d.comb += [
            group.back.eq(back),
            group.two.eq(kept.two | found.two | kept_above | found_above | cells_above),
            group.turned.eq((shares[0] + shares[2]) + shares[1]),
            group.wound.eq(kept.wound | found.wound | too_far | kept_above & kept.two | found_above & found.two),
            group.ring.eq(kept.ring | found.ring | self.ring),
        ]
        return m
