"""What walk, join and sum hand to each other, and sizes that follow from the columns."""

import math

from amaranth.hdl import Value
from amaranth.lib import data

from contactfpga.skin.derived import Derived
from contactfpga_hdl.payloads import moments_layout


def step_layout(derived: Derived) -> data.StructLayout:
    """One step of the walk: at most one run of the row before and one of the new row, of one cluster.

    A step without any run is the seam's: the last cluster goes on in the first.
    """
    column = max(1, (derived.skin.columns - 1).bit_length())
    return data.StructLayout(
        {
            "end": 1,  # no step: the mark after a frame
            "has_before": 1,
            "before": column,  # start of the run in the row before
            "has_run": 1,
            "start": column,  # first and last column of the new run
            "stop": column,
            "opens": 1,  # first and last step of a cluster
            "closes": 1,
            "row_done": 1,  # last step of a row
            "y": max(1, (derived.skin.rows - 1).bit_length()),
            "final": 1,  # no row follows in this frame
            **({"seam": 1} if derived.skin.closed else {}),  # opens the first cluster, which goes on from the last
        }
    )


def join_layout(derived: Derived) -> data.StructLayout:
    """What a step adds to its zone, and what becomes of it."""
    turns = {"down": 1, "turn": 1, "ring": 1, "first_turn": 1}  # docs/labelling.md#around-a-cylinder
    return data.StructLayout(
        {
            "end": 1,
            "closes": 1,  # the next step starts from nothing
            "run": moments_layout(derived),  # add the new run, a group from the stack, and a zone of the row before
            "pop": 1,
            "load": 1,
            "push": 1,  # put what there is on the stack, or into the table, or emit it
            "store": 1,
            "place": range(derived.open_zones),
            "leaves": 1,
            **(turns if derived.skin.closed else {}),
        }
    )


def nesting(derived: Derived) -> int:
    """The most zones with a run passed and a run to come."""
    return math.ceil(derived.skin.columns / 2) // 2


def waiting(derived: Derived) -> int:
    """The most groups that wait: each for such a zone, or where the ends meet one of them for the last cluster."""
    if not derived.skin.closed:
        return nesting(derived)
    columns = derived.skin.columns
    return (columns + 3) // 4 if derived.skin.connectivity == 8 else columns // 4 + 1


def place_of(derived: Derived, column: Value) -> Value:
    """Where a run that starts at ``column`` keeps its zone's moments."""
    return column >> 1 if derived.skin.connectivity == 8 else column
