"""A compiled board: the gateware of a Skin as native code, in a sheet of switches, stepped by the clock."""

from __future__ import annotations

import ctypes
import threading
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from contactfpga.errors import BoardClosed
from contactfpga.skin import Skin
from contactfpga.skin.derived import Derived
from contactfpga_sim.board import native
from contactfpga_sim.scenes.cells import to_words
from contactfpga_sim.sheet.converter import check_simulated
from contactfpga_sim.sheet.line import Line
from contactfpga_sim.sheet.matrix import Contention
from contactfpga_sim.sheet.shorts import Shorts

CAPTURABLE = ("rows", "records", "items", "bytes", "line", "contact", "alive", "driven", "charged", "received")
"""What a board notes: transfers of rows, zone records, what these become where they are divided, and bytes, changes of
the transmit, the contact and the alive pin, of the rows that are driven to the selecting level and of the columns that
are driven, and bytes decoded from the line. The order is that of the driver."""

EVENT = np.dtype([("cycle", "<u8"), ("data", "<u8"), ("mark", "<u8")])
"""An event: cycle (of a received byte: the first one after its stop bit); the row's cells, the record as on the
wire, the byte, the level or the driven lines, the 65th of which is the mark; and for a row whether it is the frame's
last, for a record or an item whether it is the end mark."""


class CompiledBoard:
    """A compiled board, stepped by the clock. Cycle 0 is the first after power-up, as in docs/timing.md.

    ``capture`` names the :data:`CAPTURABLE` to note, besides ``received``. ``model`` is the gateware, by default what
    :func:`model_of` says. The first board of a Skin takes some seconds to build
    (:mod:`contactfpga_sim.board.native`, also for what can go wrong).
    """

    def __init__(self, skin: Skin, capture: Iterable[str] = (), model: native.Model | None = None):
        self.skin = skin
        self._library = _library(model or model_of(skin))
        self._lock = threading.RLock()  # a call of another thread would free or run the model under this one's feet
        self._board: ctypes.c_void_p | None = ctypes.c_void_p(self._library.board_new())
        captured = sum(1 << CAPTURABLE.index(name) for name in set(capture))
        self._call("capture", ctypes.c_uint(captured))

    def _call(self, name: str, *arguments: Any) -> Any:
        """The driver's function of this name; raises :class:`BoardClosed` where there is no model any more."""
        with self._lock:
            if self._board is None:
                raise BoardClosed("the virtual board was closed; make another one")
            return getattr(self._library, f"board_{name}")(self._board, *arguments)

    @property
    def cycle(self) -> int:
        """The cycle that runs next."""
        return self._call("cycle")

    @property
    def broken(self) -> int:
        """Bytes on the line that came without a stop bit."""
        return self._call("broken")

    def press(self, cells: np.ndarray) -> None:
        """From the next cycle on these (rows, columns) bool cells are pressed."""
        self.hold(cells[None], 0)

    def restart(self, mutant: int = 0) -> None:
        """Power up again, as this mutant of the model's (:mod:`contactfpga_sim.mutants`); 0 is the gateware itself."""
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
        """From the next cycle on these lines are joined and these diodes bridged, and all others whole. Rows at the
        supply and columns with strong pulls are the slow model's only."""
        self._call("part")
        shorts = shorts or Shorts()
        for kind, pairs in enumerate((shorts.rows, shorts.columns, shorts.crossed, shorts.bridged)):
            for one, other in pairs:
                self._call("join", *map(ctypes.c_uint, (kind, one, other)))

    def settle(self, line: Line) -> None:
        """From the next cycle on columns take the time that such a line takes, and not none."""
        clock_s = 1 / self.skin.clock_hz
        press, pulled = (np.array(each) for each in ([line.share(tau, clock_s) for tau in line.press_s], line.pulled))
        if len(press) != self.skin.column_lines + 1:
            raise ValueError(f"a line for {len(press) - 1} columns; the sheet has {self.skin.column_lines}")
        arrays = (each.ctypes.data_as(ctypes.c_void_p) for each in (press, pulled))
        self._call("settle", *arrays, *map(ctypes.c_double, (line.share(line.release_s, clock_s), line.threshold)))

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
        """Run this many clock cycles. Other Python threads run meanwhile; calls of this board wait."""
        self._call("run", ctypes.c_uint64(cycles))
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
            ctypes.c_uint64(Derived(self.skin).frame_clocks if cycles is None else cycles),
        )
        self._check_pins()

    def _check_pins(self) -> None:
        if clocks := self._call("fights"):
            raise Contention(f"in {clocks} clocks a column was driven against a row")

    def send(self, data: bytes) -> None:
        """Put bytes on the board's receive pin, back to back, the first from the next cycle on."""
        self._call("send", data, ctypes.c_size_t(len(data)))

    def pull_low(self, cycles: int) -> None:
        """Hold the board's receive pin low for this many cycles from the next one on, as noise or a break does."""
        self._call("pull_low", ctypes.c_uint64(cycles))

    def take(self, boundary: str) -> np.ndarray:
        """The events of a boundary, dtype :data:`EVENT`, since they were taken last."""
        index = ctypes.c_uint(CAPTURABLE.index(boundary))
        count = ctypes.c_size_t()
        with self._lock:  # the address holds until the model runs on
            address = self._call("events", index, ctypes.byref(count))
            events = native.array_at(address, count.value, EVENT)
            self._call("forget", index)
        return events

    def receive(self) -> bytes:
        """The bytes decoded from the line since they were taken last."""
        return self.take("received")["data"].astype(np.uint8).tobytes()

    def close(self) -> None:
        """Free the model; every later call raises :class:`BoardClosed`. May be called twice."""
        with self._lock:
            if self._board is not None:
                self._call("free")
                self._board = None

    def __enter__(self) -> CompiledBoard:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


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
            "BIT_CLOCKS": Derived(skin).bit_clocks,
            "PRECHARGE": int(skin.precharge_us > 0),
            "REVERSAL": int(skin.reads_rows),
            "KEEPS": Derived(skin).settle_clocks + 1 if skin.self_test else 0,
            "PROBES": int(netlist is None),
            "ALIVE": int(skin.alive),
            "DIVIDED": int(skin.report == "barycenter"),
            "UNITS": skin.units,
            "PACED": int(Derived(skin).units.converter.pace is not None),
        },
    )


def initializer(numbers: Iterable[int]) -> str:
    """Of a C++ array."""
    return "{" + ",".join(map(str, numbers)) + "}"


def _library(model: native.Model) -> ctypes.CDLL:
    library = native.load(model)
    library.board_new.restype = ctypes.c_void_p
    library.board_cycle.restype = ctypes.c_uint64
    library.board_broken.restype = ctypes.c_uint64
    library.board_fights.restype = ctypes.c_uint64
    library.board_events.restype = ctypes.c_void_p
    return library
