"""The sheet's connection to the board: direct, or chains of 74HC595 and 74HC165."""

from __future__ import annotations

import random
from collections import deque
from collections.abc import Mapping
from typing import TYPE_CHECKING

from contactfpga_sim.model.sheet.matrix import Matrix

if TYPE_CHECKING:
    from contactfpga.skin import Skin

ROW_PINS = {"direct": ("rows",), "74hc595": ("row_data", "row_clock", "row_latch", "row_enable_n")}
COLUMN_PINS = {"direct": (), "74hc165": ("column_load_n", "column_clock")}
COLUMN_DATA = {"direct": "columns", "74hc165": "column_data"}


class RowRegisters:
    """Chains of 74HC595. Output i of a chain is its line i; power-up contents are random.

    Data count as before a rising edge of the shift clock, shifted bits as before one of the latch.
    """

    def __init__(self, lines: int, chains: int, power_up: random.Random):
        self._length = -(-lines // chains)
        self._all = (1 << self._length) - 1
        self.shifted = [power_up.getrandbits(self._length) for _ in range(chains)]
        self.latched = [power_up.getrandbits(self._length) for _ in range(chains)]
        self._before: tuple[int, int, int] | None = None

    def step(self, data: int, clock: int, latch: int, enable_n: int) -> int | None:
        """Levels of all outputs, bit r is row r; None while disabled."""
        data_before, clock_before, latch_before = self._before or (data, clock, latch)
        self._before = (data, clock, latch)
        if latch and not latch_before:
            self.latched = list(self.shifted)
        if clock and not clock_before:
            self.shifted = [
                (bits << 1 | data_before >> chain & 1) & self._all for chain, bits in enumerate(self.shifted)
            ]
        return None if enable_n else sum(bits << chain * self._length for chain, bits in enumerate(self.latched))


class ColumnRegisters:
    """Chains of 74HC165. Line i of a chain is output bit i; power-up contents are random.

    The serial output follows an edge after ``delay`` cycles.
    """

    def __init__(self, lines: int, chains: int, power_up: random.Random, delay: int = 0):
        self._length = -(-lines // chains)
        self._bits = [power_up.getrandbits(self._length) for _ in range(chains)]
        self._clock: int | None = None
        self._outputs = deque([0] * (delay + 1), delay + 1)

    def step(self, load_n: int, clock: int, columns: int) -> int:
        """Levels of the serial outputs, bit j is chain j, for these column levels."""
        rises = clock and self._clock == 0
        self._clock = clock
        if not load_n:
            mask = (1 << self._length) - 1
            self._bits = [columns >> chain * self._length & mask for chain in range(len(self._bits))]
        elif rises:
            self._bits = [bits >> 1 for bits in self._bits]
        self._outputs.append(sum((bits & 1) << chain for chain, bits in enumerate(self._bits)))
        return self._outputs[0]


class SheetAtPins:
    """A :class:`Matrix` at the pins of the gateware's top, cycle by cycle.

    ``reads``: the top's outputs to read; ``drives``: its inputs to set. ``column_delay``: as in
    :class:`ColumnRegisters`; ``row_levels``: levels of the row wires.
    """

    def __init__(self, skin: Skin, power_up: int = 0, column_delay: int = 0):
        self.matrix = Matrix(skin)
        self.reads = ROW_PINS[skin.row_drive] + COLUMN_PINS[skin.column_read]
        self.drives: tuple[str, ...] = (COLUMN_DATA[skin.column_read],)
        if skin.precharge_us:
            self.reads += ("columns_drive",)
        if skin.reads_rows and (skin.guard or skin.self_test):
            self.reads += ("columns_level",)
        if skin.reads_rows:
            self.reads += ("rows_drive",)
            self.drives += ("rows_read",)
        self._released = (1 << skin.row_lines) - 1 if skin.selects_low else 0
        self.row_levels = self._released
        contents = random.Random(power_up)
        self.row_registers: RowRegisters | None = None
        self.column_registers: ColumnRegisters | None = None
        if skin.row_drive != "direct":
            self.row_registers = RowRegisters(skin.row_lines, skin.row_chains, contents)
        if skin.column_read != "direct":
            self.column_registers = ColumnRegisters(skin.column_lines, skin.column_chains, contents, column_delay)

    def step(self, pins: Mapping[str, int]) -> tuple[int, ...]:
        """Levels of ``drives``, given those of ``reads``."""
        if self.row_registers is None:
            self.row_levels = pins["rows"]
        else:
            levels = self.row_registers.step(*(pins[name] for name in ROW_PINS["74hc595"]))
            self.row_levels = self._released if levels is None else levels & (1 << self.matrix.row_lines) - 1
        rows_driven = pins.get("rows_drive")
        columns_driven, held = self.matrix.feeding(pins.get("columns_drive", 0), pins.get("columns_level"))
        columns = self.matrix.levels(self.row_levels, rows_driven, columns_driven, held)
        if rows_driven is not None:
            return columns, self.matrix.row_levels(self.row_levels, rows_driven, columns_driven)
        if self.column_registers is None:
            return (columns,)
        return (self.column_registers.step(pins["column_load_n"], pins["column_clock"], columns),)
