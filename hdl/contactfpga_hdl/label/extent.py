"""Extents of zones: their smallest and largest columns and rows, while cells and groups are added.

``left`` and ``top`` are stored as complements. So each field is the largest of its parts', and the 0 of an empty part
changes nothing. On a sheet whose ends meet, the highest bit of a column says that it is on the upper of the group's two
turns (:class:`~contactfpga_hdl.label.around.Unwrap`). There the group's first cluster is, so an empty part may be put
there, too.
"""

from collections.abc import Iterable, Mapping

from amaranth.hdl import Cat, Const, Mux, Value
from amaranth.lib import data

from contactfpga.skin.derived import Derived

Extent = Mapping[str, Value]
"""The stored fields of cells, a group or a found group."""


def stored_extent(derived: Derived) -> dict[str, int]:
    columns, rows = derived.extent_bits[0] + derived.skin.closed, derived.extent_bits[2]
    return {"left": columns, "right": columns, "top": rows, "bottom": rows}


def extent_of_run(derived: Derived, first: Value, last: Value, y: Value) -> dict[str, Value]:
    """The fields of cells in row ``y``, from column ``first`` to ``last`` on the lower turn."""
    columns, rows = derived.extent_bits[0], derived.extent_bits[2]
    left, right = (~first)[:columns], last[:columns]
    if derived.skin.closed:
        left, right = Cat(left, Const(1, 1)), Cat(right, Const(0, 1))
    return {"left": left, "right": right, "top": (~y)[:rows], "bottom": y[:rows]}


def lifted(derived: Derived, part: Extent | data.View, above: Value) -> dict[str, Value]:
    """The fields of a part whose cells are all on the upper turn if ``above``."""
    fields = {name: part[name] for name in stored_extent(derived)}
    if derived.skin.closed:
        left, right = fields["left"], fields["right"]
        fields |= {"left": Cat(left[:-1], left[-1] & ~above), "right": Cat(right[:-1], right[-1] | above)}
    return fields


def larger(parts: Iterable[Extent]) -> dict[str, Value]:
    """The fields of all parts together."""
    first, *others = parts
    found = dict(first)
    for other in others:
        found = {name: Mux(value > other[name], value, other[name]) for name, value in found.items()}
    return found


def sent_extent(derived: Derived, group: data.View) -> Value:
    """Smallest and largest column, then row, as on the wire: all columns if they go all the way around."""
    left, right, last = ~group.left, group.right, derived.skin.columns - 1
    if derived.skin.closed:
        columns = derived.extent_bits[0]
        laps = ~left[-1] & right[-1] & (right[:columns] >= left[:columns])
        around = group.ring | group.wound | laps
        left, right = Mux(around, 0, left[:columns]), Mux(around, last, right[:columns])
    return Cat(left, right, ~group.top, group.bottom)
