"""A compiled board with bit flips and checkpoints."""

from __future__ import annotations

import ctypes
import dataclasses
import re
from collections.abc import Iterable
from typing import NamedTuple

from contactfpga.skin import Skin
from contactfpga_sim.model.board.compiled import CompiledBoard, model_of
from contactfpga_sim.model.board.native import Model

_WIRE = re.compile(r"^\t(?:/\*output\*/ )?wire<\d+> (\w+);", re.MULTILINE)
_MEMORY = re.compile(r"^\tmemory<\d+> (\w+) \{ (\d+)u };", re.MULTILINE)


class Storage(NamedTuple):
    """A register or memory of the gateware."""

    name: str
    """Name after its submodules, joined by dots."""
    width: int
    """Bits per word."""
    depth: int
    """Words; 1 for a register."""
    memory: bool

    @property
    def bits(self) -> int:
        return self.width * self.depth


class Bit(NamedTuple):
    """One bit of a storage."""

    place: int
    word: int
    bit: int


class Checkpoint:
    """A board's state at one clock, valid while the board is open."""

    def __init__(self, board: StateBoard) -> None:
        self._board = board
        self.cycle = board.cycle
        self.address = board.call("moment")

    def __del__(self) -> None:
        self._board.drop(self)


class StateBoard(CompiledBoard):
    """A compiled board with access to its state between clocks."""

    def __init__(self, skin: Skin, capture: Iterable[str] = ()):
        super().__init__(skin, capture, _model(skin))
        self._library.board_places.restype = ctypes.c_void_p
        self._library.board_moment.restype = ctypes.c_void_p
        self._library.board_same.restype = ctypes.c_bool
        self.places = self._places()

    def call(self, name: str, *arguments: object) -> int:
        found: int = self._call(name, *arguments)
        return found

    def flip(self, bit: Bit) -> None:
        """Flip this bit from the next cycle on, until the gateware writes it."""
        place = self.places[bit.place]
        if not (0 <= bit.word < place.depth and 0 <= bit.bit < place.width):
            raise ValueError(f"{bit} is outside of {place}")
        self._call("flip", *map(ctypes.c_uint32, bit))

    def moment(self) -> Checkpoint:
        """The board's current state."""
        return Checkpoint(self)

    def go_to(self, moment: Checkpoint) -> None:
        """Restore a state; captured events stay."""
        self._call("go_to", ctypes.c_void_p(moment.address))

    def same(self, moment: Checkpoint) -> bool:
        """Whether the board's future is the same as from this state."""
        return bool(self._call("same", ctypes.c_void_p(moment.address)))

    def drop(self, moment: Checkpoint) -> None:
        if self._board is not None:
            self._call("drop", ctypes.c_void_p(moment.address))

    def _places(self) -> list[Storage]:
        count = ctypes.c_size_t()
        address = self._call("places", ctypes.byref(count))
        array = (_Place * count.value).from_address(address)
        return [Storage(each.name.decode(), each.width, each.depth, each.now == each.next) for each in array]


class _Place(ctypes.Structure):
    _fields_ = (
        ("name", ctypes.c_char_p),
        ("width", ctypes.c_uint32),
        ("depth", ctypes.c_uint32),
        ("chunks", ctypes.c_uint32),
        ("now", ctypes.c_void_p),
        ("next", ctypes.c_void_p),
    )


def _model(skin: Skin) -> Model:
    model = model_of(skin)
    return dataclasses.replace(
        model, title=f"{model.title} with its state", defines={**model.defines, "STATE": 1}, places=places
    )


def places(model: str) -> str:
    """Text of ``places.inc``: registers and written memories of a generated model."""
    lines = [f'PLACE("{_plain(name)}", {name})' for name in _WIRE.findall(model)]
    lines += [
        f'MEMORY("{_plain(name.removeprefix("memory_"))}", {name}, {depth})'
        for name, depth in _MEMORY.findall(model)
        if f"{name}.update(" in model
    ]
    return "\n".join(lines) + "\n"


def _plain(mangled: str) -> str:
    return re.sub(r"__|_([0-9a-f]+)_", lambda match: chr(int(match[1], 16)) if match[1] else "_", mangled[2:])
