"""The virtual board of several sheets at one FPGA: compiled gateware in simulated time, behind the interface of a
serial port."""

from __future__ import annotations

import ctypes
import hashlib
from collections.abc import Sequence
from typing import Any

import numpy as np

from contactfpga.skin import Skin
from contactfpga.skin.several import Several, sheets_of
from contactfpga_sim.model.board import native
from contactfpga_sim.model.board.compiled import initializer
from contactfpga_sim.model.board.running import Running
from contactfpga_sim.model.scenes.cells import to_words
from contactfpga_sim.model.scenes.scene import Source
from contactfpga_sim.model.scenes.scene import scene as make_scene

LOOK_S = 0.2e-3
"""Simulated time between two looks at the scenes and at the line."""

CAPTURED = ("line", "contact", "received")
"""Changes of the transmit and of the contact pin, and bytes decoded from the line, in the order of the driver."""


class CompiledSheets(Running):
    """The gateware of several sheets as native code, each with its switches, stepped by the clock from power-up on.

    ``model`` is the gateware, by default what :func:`model_of` says.
    """

    def __init__(self, several: Several, model: native.Model | None = None):
        self.several = several
        super().__init__(model or model_of(several), CAPTURED)

    def restart(self, mutant: int = 0) -> None:
        """As :meth:`contactfpga_sim.model.board.compiled.CompiledBoard.restart`."""
        self._call("restart", ctypes.c_uint(mutant))

    def press(self, number: int, cells: np.ndarray) -> None:
        """From the next cycle on these (rows, columns) bool cells of a sheet are pressed."""
        skin = self.several.skins[number]
        if cells.shape != (skin.rows, skin.columns):
            raise ValueError(f"cells of {cells.shape}; sheet {number} is {skin.rows}x{skin.columns}")
        words = np.ascontiguousarray(to_words(cells))
        self._call("press", ctypes.c_uint(number), words.ctypes.data_as(ctypes.c_void_p))


class VirtualSheets:
    """A board of several sheets in simulated time, which passes only in :meth:`read`.

    several: the sheets; scenes: what touches each of them, for :func:`contactfpga_sim.model.scenes.scene.scene`.
    """

    def __init__(self, several: Several, scenes: Sequence[Source]):
        self.several = several
        self._scenes = [make_scene(skin, scene) for skin, scene in zip(several.skins, scenes, strict=True)]
        self._board = CompiledSheets(several)
        self._chunk = max(1, round(LOOK_S * several.clock_hz))

    def write(self, data: bytes) -> None:
        """Send bytes to the board."""
        self._board.send(data)

    def read(self, seconds: float) -> bytes:
        """Let simulated time pass until bytes have come, at most ``seconds``; returns those that came."""
        left = round(seconds * self.several.clock_hz)
        while True:
            data = self._board.receive()
            if data or left <= 0:
                return data
            cycles = min(left, self._chunk)
            self.advance(cycles)
            left -= cycles

    def advance(self, cycles: int) -> None:
        """Run clock cycles with the scenes as they are now."""
        for number, scene in enumerate(self._scenes):
            self._board.press(number, scene(self.clock()))
        self._board.run(cycles)

    def clock(self) -> float:
        """Simulated seconds since power-up."""
        return self._board.cycle / self.several.clock_hz

    def close(self) -> None:
        """Free the board."""
        self._board.close()


def model_of(several: Several) -> native.Model:
    """What the board of several sheets is built from."""

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
            "EACH_SHEET": " ".join(_entry(number, skin) for number, skin in enumerate(several.skins)),
        },
    )


def _entry(number: int, skin: Skin) -> str:
    """Of a sheet in the driver's list."""
    sizes = (number, skin.rows, skin.columns, skin.row_chains, skin.column_chains, int(skin.selects_low))
    lines = (f"LINES({initializer(line_of)[1:-1]})" for line_of in (skin.line_of_row, skin.line_of_column))
    return f"SHEET({', '.join((*map(str, sizes), *lines))})"
