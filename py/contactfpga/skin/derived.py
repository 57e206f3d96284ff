"""Everything that follows from a Skin: clocks, widths and depths, computed here and in the classes that it extends."""

from __future__ import annotations

import functools
import math

from contactfpga.choices import debounces, labellers
from contactfpga.choices.labellers import Labeller
from contactfpga.skin.row_times import RowTimes, whole
from contactfpga.skin.units import Units
from contactfpga.skin.widths import CHECK_BYTES as CHECK_BYTES
from contactfpga.skin.widths import HEARD_BITS as HEARD_BITS
from contactfpga.skin.widths import SEQUENCE_BITS as SEQUENCE_BITS
from contactfpga.skin.widths import TIME_BITS as TIME_BITS

HELLO_PERIOD_US = 500_000
"""The board says hello this often, so that one can wait for a frame and still come every second."""

HELLO_BIT = 19
"""Of the clock in us: a scan that waits makes a hello due when it turns, every 0.52 s."""
KEEP_ALIVE_BIT = 10
"""Likewise: a keep-alive is counted in its turns, of 1.024 ms."""

EPOCH_BITS = 22
"""The board counts whole times 2^22 us beside a frame's time, less than half of what that can tell."""
STUCK_BITS = 3
STUCK_MAX = (1 << STUCK_BITS) - 1
"""The stuck-line counter stops here."""

SELF_TEST = 1
"""Number of a command: test all lines (docs/protocol.md)."""
SAMPLE_AT = 2
"""Of another one: sample the columns at another clock of the time for which a row is driven."""


class Derived(RowTimes):
    """Clocks, widths and depths of a :class:`~contactfpga.Skin`."""

    @functools.cached_property
    def labeller(self) -> Labeller:
        return labellers.find(self.skin.labeller)

    @functools.cached_property
    def debounced(self) -> bool:
        return bool(debounces.find(self.skin.debounce).gateware)

    @property
    def commands(self) -> tuple[int, ...]:
        """Numbers of the commands that the board takes."""
        self_test = (SELF_TEST,) if self.skin.self_test else ()
        moves = self.scan.moves_sample and not self.report.zones
        return self_test + ((SAMPLE_AT,) if moves else ()) + self.units.commands

    @functools.cached_property
    def units(self) -> Units:
        """What follows from its pressure units."""
        return Units(self.skin)

    # ---- times, in clocks unless named otherwise

    @property
    def max_frame_slots(self) -> int:
        """The most row times that a frame can take."""
        return self.scan.max_frame_slots(self)

    @property
    def max_frame_clocks(self) -> int:
        """The most clocks that a frame can take, from its first sample to its last."""
        return self.scan.max_frame_clocks(self)

    @property
    def skips(self) -> bool:
        """Rows that were not driven are not handed on, but for an empty one where zones have to end."""
        return self.scan.waits and self.report.zones

    @property
    def min_row_clocks(self) -> int:
        """A row must last until debounce and labeller are done with the one before it, end mark and all, and a frame
        until the one before it is packed: the scanner's tag is kept for no longer."""
        return self.scan.min_row_clocks(self)

    @property
    def debounce_clocks(self) -> int:
        """How much later a row leaves the debounce."""
        return self.skin.columns + 3 if self.debounced else 0

    @property
    def packed_clocks(self) -> int:
        """From the offer of a frame's last row to the end of its packing, but for the bytes packed in this time."""
        return 1 + self.debounce_clocks + self.label_clocks + 2 + 4

    def items_clocks(self, items: int) -> int:
        """For a frame's items and trailer, a byte per clock; where items are divided that takes longer than packing."""
        plain = items * self.item_bytes + self.trailer_bytes
        stuffing = math.ceil(plain / 254)
        if not self.report.divided:
            return plain + stuffing
        return items * self.item_clocks + self.item_bytes + self.trailer_bytes + stuffing

    @property
    def keep_alive_frames(self) -> int:
        """A frame is sent at the latest after this many scans; where frames differ in length, after this many row
        times."""
        clocks = self.skin.keep_alive_ms * 1000 * self.clocks_per_us
        if self.scan.even:
            return math.floor(clocks / self.frame_clocks + 1e-9)
        return math.floor(clocks / self.row_clocks + 1e-9) - self.max_frame_slots + 1

    @property
    def keep_alive_turns(self) -> int:
        """Turns of the clock's bit ``KEEP_ALIVE_BIT`` after which a scan that waits sends a frame; the rest of the time
        is for that frame."""
        return math.floor(self.skin.keep_alive_ms * 1000 / (1 << KEEP_ALIVE_BIT) + 1e-9) - self._spare_turns

    @property
    def min_keep_alive_ms(self) -> float:
        """Of a scan that waits."""
        return (self._spare_turns + 1) * (1 << KEEP_ALIVE_BIT) / 1000

    @property
    def _spare_turns(self) -> int:
        return 1 + math.ceil(2 * self.frame_clocks / ((1 << KEEP_ALIVE_BIT) * self.clocks_per_us))

    @property
    def hello_frames(self) -> int:
        """A hello is due after this many scans; where frames differ in length, after this many row times."""
        periods = max(1, math.floor(HELLO_PERIOD_US * self.clocks_per_us / self.frame_clocks + 1e-9))
        return periods if self.scan.even else periods * self.skin.rows

    @property
    def press_scans(self) -> int:
        """Scan periods that last at least debounce_press_us."""
        return whole(self.skin.debounce_press_us * self.clocks_per_us / self.frame_clocks)

    @property
    def release_scans(self) -> int:
        """Scan periods that last at least debounce_release_us."""
        return whole(self.skin.debounce_release_us * self.clocks_per_us / self.frame_clocks)

    @property
    def press_ticks(self) -> int:
        """A press has lasted when this many ticks are over: row times, or us of a scan that waits; docs/timing.md."""
        return self._debounce_ticks(self.skin.debounce_press_us, self.press_scans)

    @property
    def release_ticks(self) -> int:
        """The same of a release."""
        return self._debounce_ticks(self.skin.debounce_release_us, self.release_scans)

    def _debounce_ticks(self, us: float, scans: int) -> int:
        if self.scan.waits:
            return whole(us) + 1 if us else 0
        return max(0, (scans - 1) * self.skin.rows + 1)

    # ---- widths in bits and sizes in bytes

    @functools.cached_property
    def tick_bits(self) -> int:
        """Of a count in which a debounce time, and two frames more, can be counted."""
        longest = max(self.press_ticks, self.release_ticks)
        if self.scan.waits:
            frame = self.max_frame_clocks + self.packed_clocks + self.items_clocks(self.max_items)
            return (longest + 2 * math.ceil(frame / self.clocks_per_us)).bit_length()
        return (longest + 2 * self.max_frame_slots).bit_length()

    @property
    def cell_bits(self) -> int:
        """Of a whole number of cells that a barycenter can be away from the origin, along the longer side."""
        return (max(self.skin.rows, self.skin.columns) - 1).bit_length()

    @property
    def quotient_bits(self) -> int:
        """Of a barycenter before it is rounded: one fraction bit more than there will be. One comes each clock."""
        return self.cell_bits + self.skin.barycenter_bits + 1

    @property
    def item_clocks(self) -> int:
        """The most clocks from an item to the next while many wait."""
        divided = self.quotient_bits + 1 if self.report.divided else 0
        return max(self.item_bytes, divided)

    # ---- sizes of tables

    @functools.cached_property
    def open_zones(self) -> int:
        """The most zones two adjacent rows can hold between them: C/2 with 8-connectivity, C with 4."""
        return math.ceil(self.skin.columns / 2) if self.skin.connectivity == 8 else self.skin.columns

    @property
    def label_clocks(self) -> int:
        """The most clocks from a frame's last row to its end mark."""
        return self.labeller.end_clocks(self) if self.report.zones else 3

    @property
    def label_row_clocks(self) -> int:
        """The most clocks from a row to the next one that the labeller, or what stands in its place, can take."""
        return self.labeller.row_clocks(self) if self.report.zones else 1

    @property
    def label_empty_row_clocks(self) -> int:
        """The same for an empty row below an empty row."""
        return self.labeller.empty_row_clocks(self) if self.report.zones else 1

    @functools.cached_property
    def backlog(self) -> int:
        """Items that can wait for the packer.

        Two rows close at most ``open_zones`` zones, so a burst of that many may come at once; where packing
        them takes longer than two rows the rest adds up, over at most the capacity of two frames. Bitmap rows
        are packed before the next one comes. An adaptive scan omits empty rows, so that every row may close as many
        zones, and bitmap rows of two frames may wait. A scan that waits has one frame at most under
        way, and its first item is taken before its end mark comes; a power of two takes less logic.
        """
        if self.scan.waits:
            return max(8, 1 << (self.max_items - 1).bit_length())
        if not self.report.zones:
            return 4 if self.scan.even else 2 * self.skin.rows + 2
        busy = self.open_zones * self.item_clocks
        late = max(0.0, 1 - (2 if self.scan.even else 1) * self.row_clocks / busy)
        return 2 * self.open_zones + math.ceil(2 * self.zone_capacity * late) + 2
