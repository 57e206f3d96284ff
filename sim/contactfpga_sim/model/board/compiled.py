"""A compiled board: the gateware of a Skin as native code, in a sheet of switches, stepped by the clock."""

from __future__ import annotations

import ctypes
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from contactfpga.skin import Skin
from contactfpga_sim.model.board import native
from contactfpga_sim.model.board.running import Running
from contactfpga_sim.model.scenes.cells import to_words
from contactfpga_sim.model.sheet.converter import check_simulated
from contactfpga_sim.model.sheet.line import Line, RowLine
from contactfpga_sim.model.sheet.matrix import Contention
from contactfpga_sim.model.sheet.shorts import Shorts

CAPTURABLE = ("rows", "records", "items", "bytes", "line", "contact", "alive", "driven", "charged", "received")
"""What a board notes: transfers of rows, zone records, what these become where they are divided, and bytes, changes of
the transmit, the contact and the alive pin, of the rows that are driven to the selecting level and of the columns that
are driven, and bytes decoded from the line. The order is that of the driver."""


class CompiledBoard(Running):
    """A compiled board of one sheet.

    ``capture`` names the :data:`CAPTURABLE` to note, besides ``received``. ``model`` is the gateware, by default what
    :func:`model_of` says. The first board of a Skin takes some seconds to build
    (:mod:`contactfpga_sim.model.board.native`, also for what can go wrong).
    """

    def __init__(self, skin: Skin, capture: Iterable[str] = (), model: native.Model | None = None):
        self.skin = skin
        super().__init__(model or model_of(skin), CAPTURABLE)
        for name in ("broken", "fights"):
            getattr(self._library, f"board_{name}").restype = ctypes.c_uint64
        captured = sum(1 << CAPTURABLE.index(name) for name in set(capture))
        self._call("capture", ctypes.c_uint(captured))

    @property
    def broken(self) -> int:
        """Bytes on the line that came without a stop bit."""
        return self._call("broken")

    def press(self, cells: np.ndarray) -> None:
        """From the next cycle on these (rows, columns) bool cells are pressed."""
        self.hold(cells[None], 0)

    def restart(self, mutant: int = 0) -> None:
        """Power up again, as this mutant (:mod:`contactfpga_sim.verify.mutants`); 0 is the gateware itself."""
        self._call("restart", ctypes.c_uint(mutant))

    def stick(self, columns: np.ndarray | None) -> None:
        """From the next cycle on these (columns,) bool columns read pressed whatever row is driven; the guard column
        may come after them."""
        stuck = np.zeros(self.skin.column_lines, np.uint8)
        if columns is not None:
            stuck[: len(columns)] = columns
        self._call("stick", stuck.ctypes.data_as(ctypes.c_void_p))

    def cut(self, rows: Mapping[int, int], columns: Mapping[int, int]) -> None:
        """From the next cycle on these lines are cut, and all others whole: of ``rows`` the switches from a column on
        no longer reach the pin, of ``columns`` those from a row on. Guard lines are the last."""
        skin = self.skin
        ends = (
            np.array([cut.get(line, whole) for line in range(lines)], np.uint8)
            for cut, lines, whole in (
                (rows, skin.row_lines, skin.column_lines),
                (columns, skin.column_lines, skin.row_lines),
            )
        )
        self._call("cut", *(end.ctypes.data_as(ctypes.c_void_p) for end in ends))

    def join(self, shorts: Shorts | None) -> None:
        """From the next cycle on these lines are joined and these diodes bridged, and all others whole."""
        self._call("part")
        shorts = shorts or Shorts()
        supplied, pulled = ((row, 0) for row in shorts.supplied), ((0, column) for column in shorts.pulled)
        kinds = (shorts.rows, shorts.columns, shorts.crossed, shorts.bridged, supplied, pulled)
        for kind, pairs in enumerate(kinds):
            for one, other in pairs:
                self._call("join", *map(ctypes.c_uint, (kind, one, other)))

    def settle(self, line: Line, rows: RowLine | None = None) -> None:
        """From the next cycle on columns take the time that such a line takes, and not none; so do ``rows`` that are
        let go."""
        self._settle("settle", line.press_s, line.pulled, line.release_s, line.threshold)
        if rows is not None:
            self._settle("settle_rows", rows.rise_s, rows.lifted, rows.fall_s, rows.threshold)

    def _settle(self, name: str, toward_s: Sequence[float], ends: Sequence[float], back_s: float, at: float) -> None:
        if len(toward_s) != self.skin.column_lines + 1:
            raise ValueError(f"a line for {len(toward_s) - 1} columns; the sheet has {self.skin.column_lines}")
        clock_s = 1 / self.skin.clock_hz
        shares = np.array([Line.share(tau, clock_s) for tau in toward_s])
        arrays = (each.ctypes.data_as(ctypes.c_void_p) for each in (shares, np.array(ends, float)))
        self._call(name, *arrays, *map(ctypes.c_double, (Line.share(back_s, clock_s), at)))

    def slow(self, rows: Mapping[int, float], columns: Mapping[int, float]) -> None:
        """From the next cycle on, where columns take time (:meth:`settle`), they take longer by these factors: all
        while one of ``rows`` pulls them, and each of ``columns``. Guard lines are the last."""
        skin = self.skin
        factors = (
            np.array([given.get(line, 1.0) for line in range(lines)])
            for given, lines in ((rows, skin.row_lines), (columns, skin.column_lines))
        )
        self._call("slow", *(each.ctypes.data_as(ctypes.c_void_p) for each in factors))

    def load(self, readings: Iterable[int]) -> None:
        """From the next cycle on the converter's inputs would read this, one for each pressure unit; 0 at first."""
        codes = np.array(list(readings), np.uint32)
        if len(codes) != self.skin.units:
            raise ValueError(f"{len(codes)} readings; the board has {self.skin.units} pressure units")
        self._call("load", codes.ctypes.data_as(ctypes.c_void_p))

    def run(self, cycles: int) -> None:
        """As :meth:`Running.run`; raises :class:`Contention` where a column was driven against a row."""
        super().run(cycles)
        self._check_pins()

    def hold(self, frames: np.ndarray, cycles: int | None = None) -> None:
        """Press each of (n, rows, columns) bool frames for this many cycles, by default for one scan."""
        if frames.shape[1:] != (self.skin.rows, self.skin.columns):
            raise ValueError(f"cells of {frames.shape[1:]}; the sheet is {self.skin.rows}x{self.skin.columns}")
        words = np.ascontiguousarray(to_words(frames))
        self._call(
            "hold",
            words.ctypes.data_as(ctypes.c_void_p),
            ctypes.c_size_t(len(words)),
            ctypes.c_uint64(self.skin.derived.frame_clocks if cycles is None else cycles),
        )
        self._check_pins()

    def _check_pins(self) -> None:
        if clocks := self._call("fights"):
            raise Contention(f"in {clocks} clocks a column was driven against a row")

    def pull_low(self, cycles: int) -> None:
        """Hold the board's receive pin low for this many cycles from the next one on, as noise or a break does."""
        self._call("pull_low", ctypes.c_uint64(cycles))


def model_of(skin: Skin, netlist: native.Netlist | None = None) -> native.Model:
    """What the board of a Skin is built from: its gateware, or a netlist with the gateware's pins and no probes,
    which notes neither rows nor records nor bytes."""

    check_simulated(skin)

    def elaborate() -> Any:
        from contactfpga_hdl.top import Top

        return netlist or Top(skin, probes=True)

    return native.Model(
        title=f"the {skin.rows}x{skin.columns} board" + (" from its netlist" if netlist else ""),
        driver="board.cpp",
        key=netlist.key if netlist else native.skin_key(skin),
        elaborate=elaborate,
        defines={
            "ROWS": skin.rows,
            "COLUMNS": skin.columns,
            "GUARD": int(skin.guard),
            "LINE_OF_ROW": initializer(skin.line_of_row),
            "LINE_OF_COLUMN": initializer(skin.line_of_column),
            "COL2ROW": int(skin.selects_low),
            "ROW_CHAINS": 0 if skin.row_drive == "direct" else skin.row_chains,
            "COLUMN_CHAINS": 0 if skin.column_read == "direct" else skin.column_chains,
            "BIT_CLOCKS": skin.derived.bit_clocks,
            "PRECHARGE": int(skin.precharge_us > 0),
            "REVERSAL": int(skin.reads_rows),
            "KEEPS": skin.derived.settle_clocks + 1 if skin.self_test else 0,
            "PROBES": int(netlist is None),
            "ALIVE": int(skin.alive),
            "DIVIDED": int(skin.report == "barycenter"),
            "UNITS": skin.units,
            "PACED": int(skin.derived.units.converter.pace is not None),
        },
    )


def initializer(numbers: Iterable[int]) -> str:
    """Of a C++ array."""
    return "{" + ",".join(map(str, numbers)) + "}"
