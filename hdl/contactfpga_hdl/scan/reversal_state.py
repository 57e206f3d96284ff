"""Line reversal: what its parts share."""

from amaranth.hdl import Signal

from contactfpga.skin import Skin
from contactfpga.skin.derived import Derived
from contactfpga_hdl.payloads import row_bits


class Sheet:
    """What the sheet shows, and what the board does to it."""

    def __init__(self, skin: Skin):
        self.pressed = Signal(skin.column_lines)  # columns that read pressed
        self.read = Signal(skin.rows)  # rows that read touched and have a switch that is not masked
        self.touched = Signal(skin.rows)  # rows to drive: they read touched, or have a debounce time running
        self.clean = Signal()  # a row without a masked switch reads touched
        self.charges = Signal()  # columns are driven in the next clock
        self.listens = Signal()  # rows are let go in the next clock
        self.selected = Signal(skin.rows)  # rows that are driven to the selecting level
        self.guard = Signal()  # so is the guard row
        self.inverts = Signal()  # in the next clock the guard column has the released level, the others do not


class Turn:
    """Where the scan is in a frame."""

    def __init__(self, derived: Derived):
        rows = derived.skin.rows
        self.begins = Signal()  # high for a clock: rows were sampled, and the frame is what they showed
        self.rests = Signal()  # they showed nothing, and are watched since
        self.settled = Signal()  # rows have been let go for long enough
        self.wanted = Signal()  # a frame is, though nothing is touched
        self.underway = Signal()  # a frame has begun and is not packed
        self.todo = Signal(rows)  # rows still to be driven in this frame
        self.y = Signal(row_bits(derived))  # of the row that is driven, or was last
        self.following = Signal(row_bits(derived))  # of the next one
        self.strobe = Signal()  # high for a clock: the columns of that row are there
        self.waits = Signal()  # a row is on its way, or on offer
        self.asked = Signal()  # a slot of the self-test is
        self.lets_go = Signal()  # high for a clock: one begins
        self.tests = Signal()  # it is under way
        self.tested = Signal()  # high for a clock, its last one
