"""Compiled boards of one or several sheets: native gateware with its switches."""

from __future__ import annotations

import ctypes
import hashlib
import math
import threading
from collections.abc import Iterable, Mapping, Sequence
from types import TracebackType
from typing import Any, Self

import numpy as np

from contactfpga.errors import BoardClosed
from contactfpga.skin import Skin
from contactfpga.skin.several import Several, sheets_of
from contactfpga_sim.model.board import native, webassembly
from contactfpga_sim.model.scenes.cells import to_words
from contactfpga_sim.model.sheet.converter import check_simulated
from contactfpga_sim.model.sheet.line import ColumnLine, RowLine
from contactfpga_sim.model.sheet.matrix import Contention, Shorts

EVENT = np.dtype([("cycle", "<u8"), ("data", "<u8"), ("mark", "<u8")])
"""Dtype of an event. ``cycle``: of a received byte the first after its stop bit. ``data``: cells of a row, a record as
on the wire, a byte, or levels of lines. ``mark``: a frame's last row, an end mark, or the 65th driven line."""


Library = native.Library | webassembly.WebAssemblyLibrary


class CompiledModel:
    """A thread-safe model, stepped by the clock; cycle 0 is the first after power-up. Inputs hold from the next cycle
    on.

    ``events``: events that the driver can record, in its order.
    """

    def __init__(self, library: Library, events: tuple[str, ...]):
        self._library = library
        for name in ("new", "events"):
            getattr(library, f"board_{name}").restype = ctypes.c_void_p
        library.board_cycle.restype = ctypes.c_uint64
        library.board_count.restype = ctypes.c_size_t
        self._events = events
        self._lock = threading.RLock()  # a call of another thread would free or run the model under this one's feet
        self._board: ctypes.c_void_p | None = ctypes.c_void_p(library.board_new())

    def _call(self, name: str, *arguments: Any) -> Any:
        with self._lock:
            if self._board is None:
                raise BoardClosed("the virtual board was closed; make another one")
            return getattr(self._library, f"board_{name}")(self._board, *arguments)

    @property
    def cycle(self) -> int:
        """Next cycle to run."""
        return self._call("cycle")

    def run(self, cycles: int) -> None:
        """Run clock cycles. Other Python threads run meanwhile; other calls of this board wait."""
        self._call("run", ctypes.c_uint64(cycles))

    def send(self, data: bytes) -> None:
        """Send bytes back to back to the receive pin."""
        self._call("send", data, ctypes.c_size_t(len(data)))

    def take(self, boundary: str) -> np.ndarray:
        """Events at a boundary since the last call, dtype :data:`EVENT`."""
        index = ctypes.c_uint(self._events.index(boundary))
        with self._lock:  # the address holds until the model runs on
            if not (count := self._call("count", index)):
                return np.zeros(0, EVENT)
            data = self._library.string_at(self._call("events", index), count * EVENT.itemsize)
            self._call("forget", index)
        return np.frombuffer(data, EVENT).copy()

    def receive(self) -> bytes:
        """Bytes decoded from the line since the last call."""
        return self.take("received")["data"].astype(np.uint8).tobytes()

    def close(self) -> None:
        """Free the model; later calls of other methods raise :class:`BoardClosed`."""
        with self._lock:
            if self._board is not None:
                self._call("free")
                self._board = None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


_DRIVER = "board.cpp"

CAPTURABLE = ("rows", "records", "items", "bytes", "line", "contact", "alive", "driven", "charged", "received")
"""Events that a board can record, in the driver's order: transfers; changes of the transmit, contact and alive pins, of
rows driven to the selecting level, and of driven columns; bytes decoded from the line."""


class CompiledBoard(CompiledModel):
    """A compiled board of one sheet.

    ``capture``: names of :data:`CAPTURABLE` to record besides ``received``. ``model``: source of native code, default
    that of :func:`library_of`.
    """

    def __init__(self, skin: Skin, capture: Iterable[str] = (), model: native.Model | None = None):
        self.skin = skin
        super().__init__(native.load(model) if model else library_of(skin), CAPTURABLE)
        for name in ("broken", "fights", "run", "hold"):
            getattr(self._library, f"board_{name}").restype = ctypes.c_uint64
        captured = sum(1 << CAPTURABLE.index(name) for name in set(capture))
        self._call("capture", ctypes.c_uint(captured))

    @property
    def broken(self) -> int:
        """Number of bytes on the line without a stop bit."""
        return self._call("broken")

    def press(self, cells: np.ndarray) -> None:
        """Press these (rows, columns) bool cells."""
        self.hold(cells[None], 0)

    def restart(self, mutant: int = 0) -> None:
        """Power up again, as a mutant of :mod:`contactfpga_sim.verify.mutants` if not 0."""
        self._call("restart", ctypes.c_uint(mutant))

    def stick(self, columns: np.ndarray | None) -> None:
        """Set the (columns,) bool stuck columns; a guard column may follow."""
        stuck = np.zeros(self.skin.column_lines, np.uint8)
        if columns is not None:
            stuck[: len(columns)] = columns
        self._call("stick", stuck.tobytes())

    def cut(self, rows: Mapping[int, int], columns: Mapping[int, int]) -> None:
        """Set the cut lines, as in :class:`contactfpga_sim.model.golden.trace.Cuts`."""
        skin = self.skin
        ends = (
            bytes(cut.get(line, whole) for line in range(lines))
            for cut, lines, whole in (
                (rows, skin.row_lines, skin.column_lines),
                (columns, skin.column_lines, skin.row_lines),
            )
        )
        self._call("cut", *ends)

    def join(self, shorts: Shorts | None) -> None:
        """Set the joined lines and bridged diodes."""
        self._call("part")
        shorts = shorts or Shorts()
        supplied, pulled = ((row, 0) for row in shorts.supplied), ((0, column) for column in shorts.pulled)
        kinds = (shorts.rows, shorts.columns, shorts.crossed, shorts.bridged, supplied, pulled)
        for kind, pairs in enumerate(kinds):
            for one, other in pairs:
                self._call("join", *map(ctypes.c_uint, (kind, one, other)))

    def settle(self, line: ColumnLine, rows: RowLine | None = None) -> None:
        """Set how columns, and released ``rows``, settle; initially at once."""
        self._settle("settle", line.press_s, line.pulled, line.release_s, line.threshold)
        if rows is not None:
            self._settle("settle_rows", rows.rise_s, rows.lifted, rows.fall_s, rows.threshold)

    def _settle(self, name: str, toward_s: Sequence[float], ends: Sequence[float], back_s: float, at: float) -> None:
        if len(toward_s) != self.skin.column_lines + 1:
            raise ValueError(f"a line for {len(toward_s) - 1} columns; the sheet has {self.skin.column_lines}")
        clock_s = 1 / self.skin.clock_hz
        shares = [ColumnLine.share(tau, clock_s) for tau in toward_s]
        arrays = (np.array(each, float).tobytes() for each in (shares, ends))
        self._call(name, *arrays, *map(ctypes.c_double, (ColumnLine.share(back_s, clock_s), at)))

    def slow(self, rows: Mapping[int, float], columns: Mapping[int, float]) -> None:
        """Multiply settling times: of all columns while one of ``rows`` pulls them, and of each of ``columns``. Guard
        lines are last."""
        skin = self.skin
        factors = (
            np.array([given.get(line, 1.0) for line in range(lines)])
            for given, lines in ((rows, skin.row_lines), (columns, skin.column_lines))
        )
        self._call("slow", *(each.tobytes() for each in factors))

    def fall(self, seconds: np.ndarray, end: float, threshold: float) -> None:
        """Let columns fall exponentially to ``end``, and past the pin's ``threshold`` after (row lines, column lines)
        ``seconds`` of a selected row; both are shares of the way to ground. Guard lines are last."""
        skin = self.skin
        lines = np.empty_like(seconds)
        lines[np.ix_(skin.line_of_row, skin.line_of_column)] = seconds
        shares = -np.expm1(math.log1p(-threshold / end) / (lines * skin.clock_hz))
        self._call("fall", shares.tobytes(), ctypes.c_double(end), ctypes.c_double(threshold))

    def disturb(self, noise: float, edge: float, edge_s: float, edge_hz: float) -> None:
        """Add noise of this standard deviation, and edges, to falling columns: shares of the way to ground."""
        clocks = (self.skin.clock_hz / edge_hz, self.skin.clock_hz * edge_s) if edge_hz else (math.inf, 0.0)
        self._call("disturb", *map(ctypes.c_double, (noise, edge, *clocks)))

    def load(self, readings: Iterable[int]) -> None:
        """Set the converter's input of each pressure unit; initially 0."""
        codes = np.array(list(readings), np.uint32)
        if len(codes) != self.skin.units:
            raise ValueError(f"{len(codes)} readings; the board has {self.skin.units} pressure units")
        self._call("load", codes.tobytes())

    def run(self, cycles: int) -> None:
        """Run clock cycles. Raises :class:`Contention` if a column was driven against a row."""
        self._check_pins(self._call("run", ctypes.c_uint64(cycles)))

    def hold(self, frames: np.ndarray, cycles: int | None = None) -> None:
        """Press each of (n, rows, columns) bool frames for ``cycles``, by default one scan."""
        if frames.shape[1:] != (self.skin.rows, self.skin.columns):
            raise ValueError(f"cells of {frames.shape[1:]}; the sheet is {self.skin.rows}x{self.skin.columns}")
        each = ctypes.c_uint64(self.skin.derived.frame_clocks if cycles is None else cycles)
        self._check_pins(self._call("hold", to_words(frames).tobytes(), ctypes.c_size_t(len(frames)), each))

    @property
    def fights(self) -> int:
        """Clocks so far in which a column was driven against a row."""
        return int(self._call("fights"))

    def pull_low(self, cycles: int) -> None:
        """Hold the receive pin low, like noise or a break."""
        self._call("pull_low", ctypes.c_uint64(cycles))

    def _check_pins(self, fights: int) -> None:
        if fights:
            raise Contention(f"in {fights} clocks a column was driven against a row")


def library_of(skin: Skin) -> Library:
    """Library of a Skin's board: packaged WebAssembly, or native code."""
    check_simulated(skin)
    return webassembly.load(carried_key(skin)) or native.load(model_of(skin))


def carried_key(skin: Skin) -> str:
    return webassembly.board_key(webassembly.gateware_of(skin), _DRIVER, _defines(skin))


def design_key(skin: Skin) -> str:
    """Key of the elaborated gateware, independent of its text."""
    return webassembly.board_key(native.component_key(model_of(skin).elaborate()), _DRIVER, _defines(skin))


def model_of(skin: Skin, netlist: native.Netlist | None = None) -> native.Model:
    """Source of a Skin's board: its gateware, or a netlist with the gateware's pins but no probes."""
    check_simulated(skin)

    def elaborate() -> Any:
        from contactfpga_hdl.top import Top

        return netlist or Top(skin, probes=True)

    return native.Model(
        title=f"the {skin.rows}x{skin.columns} board" + (" from its netlist" if netlist else ""),
        driver=_DRIVER,
        key=netlist.key if netlist else native.skin_key(skin),
        elaborate=elaborate,
        defines=_defines(skin, probes=netlist is None),
    )


def _defines(skin: Skin, probes: bool = True) -> dict[str, int | str]:
    return {
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
        "PROBES": int(probes),
        "ALIVE": int(skin.alive),
        "DIVIDED": int(skin.report == "barycenter"),
        "UNITS": skin.units,
        "PACED": int(skin.derived.units.converter.pace is not None),
    }


SHEETS_CAPTURED = ("line", "contact", "received")
"""Events recorded of several sheets, in the driver's order."""


class CompiledSheets(CompiledModel):
    """The compiled gateware of several sheets.

    ``model``: default that of :func:`sheets_model`.
    """

    def __init__(self, several: Several, model: native.Model | None = None):
        self.several = several
        super().__init__(native.load(model or sheets_model(several)), SHEETS_CAPTURED)

    def restart(self, mutant: int = 0) -> None:
        self._call("restart", ctypes.c_uint(mutant))

    def press(self, number: int, cells: np.ndarray) -> None:
        """Press these (rows, columns) bool cells of a sheet."""
        skin = self.several.skins[number]
        if cells.shape != (skin.rows, skin.columns):
            raise ValueError(f"cells of {cells.shape}; sheet {number} is {skin.rows}x{skin.columns}")
        self._call("press", ctypes.c_uint(number), to_words(cells).tobytes())

    def plug(self, number: int, plugged: bool) -> None:
        """Plug a sheet's cable in, or pull it off, between its shift registers and the FPGA."""
        self._call("plug", ctypes.c_uint(number), ctypes.c_bool(plugged))


def sheets_model(several: Several) -> native.Model:
    """Source of a board of several sheets."""

    def elaborate() -> Any:
        from contactfpga_hdl.several import SeveralTop

        return SeveralTop(several)

    keys = "".join(map(native.skin_key, several.skins))
    return native.Model(
        title=f"the board of {sheets_of(several.skins)}",
        driver="several.cpp",
        key=hashlib.sha256(keys.encode()).hexdigest(),
        elaborate=elaborate,
        defines={
            "BIT_CLOCKS": several.skins[0].derived.bit_clocks,
            "EACH_SHEET": " ".join(_sheet_entry(number, skin) for number, skin in enumerate(several.skins)),
        },
    )


def _sheet_entry(number: int, skin: Skin) -> str:
    flags = int(skin.guard), skin.row_chains, skin.column_chains, int(skin.selects_low)
    sizes = (number, skin.rows, skin.columns, *flags)
    lines = (f"LINES({initializer(line_of)[1:-1]})" for line_of in (skin.line_of_row, skin.line_of_column))
    return f"SHEET({', '.join((*map(str, sizes), *lines))})"


def initializer(numbers: Iterable[int]) -> str:
    """C++ initializer of an array."""
    return "{" + ",".join(map(str, numbers)) + "}"
