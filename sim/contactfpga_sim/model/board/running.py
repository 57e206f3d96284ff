"""A compiled model that runs: what boards of one sheet and of several have in common."""

from __future__ import annotations

import ctypes
import threading
from types import TracebackType
from typing import Any, Self

import numpy as np

from contactfpga.errors import BoardClosed
from contactfpga_sim.model.board import native

EVENT = np.dtype([("cycle", "<u8"), ("data", "<u8"), ("mark", "<u8")])
"""An event: cycle (of a received byte: the first one after its stop bit); the row's cells, the record as on the
wire, the byte, the level or the driven lines, the 65th of which is the mark; and for a row whether it is the frame's
last, for a record or an item whether it is the end mark."""


class Running:
    """A model, stepped by the clock; cycle 0 is the first after power-up, as in docs/timing.md. Safe for threads.

    ``events``: what the driver can note, in its order.
    """

    def __init__(self, model: native.Model, events: tuple[str, ...]):
        self._library = library = native.load(model)
        for name in ("new", "events"):
            getattr(library, f"board_{name}").restype = ctypes.c_void_p
        library.board_cycle.restype = ctypes.c_uint64
        self._events = events
        self._lock = threading.RLock()  # a call of another thread would free or run the model under this one's feet
        self._board: ctypes.c_void_p | None = ctypes.c_void_p(library.board_new())

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

    def run(self, cycles: int) -> None:
        """Run this many clock cycles. Other Python threads run meanwhile; calls of this board wait."""
        self._call("run", ctypes.c_uint64(cycles))

    def send(self, data: bytes) -> None:
        """Put bytes on the board's receive pin, back to back, the first from the next cycle on."""
        self._call("send", data, ctypes.c_size_t(len(data)))

    def take(self, boundary: str) -> np.ndarray:
        """The events of a boundary, dtype :data:`EVENT`, since they were taken last."""
        index, count = ctypes.c_uint(self._events.index(boundary)), ctypes.c_size_t()
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

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
