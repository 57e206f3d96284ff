"""A simulated FlexiTac sheet on a pseudo-terminal, with losses and errors."""

from __future__ import annotations

import os
import select
import threading
import tty
from collections.abc import Callable

import numpy as np

ROWS, COLUMNS = 16, 32
MARK = b"\xaa\x55"
LOOK_S = 0.05
"""Interval in s of checks for the end while nobody reads."""


class FlexitacSheet:
    """Sends ``hz`` frames per second to :attr:`port` in a ``with`` block.

    ``scene``: function from time in s to the (16, 32) force at each cell, 0 to 1. A cell reads its rest value, up to
    40, noise of 2, and 150 times force. ``lost``, ``wrong``: shares of bytes lost or changed.
    """

    def __init__(
        self,
        scene: Callable[[float], np.ndarray],
        hz: float = 100.0,
        lost: float = 0.0,
        wrong: float = 0.0,
        seed: int = 0,
    ):
        self._scene, self._hz, self._lost, self._wrong = scene, hz, lost, wrong
        self._rng = np.random.default_rng(seed)
        self._rest = self._rng.integers(0, 40, (ROWS, COLUMNS))
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name="FlexiTac", daemon=True)
        self._master, self._slave = os.openpty()
        tty.setraw(self._slave)
        os.set_blocking(self._master, False)
        self.port = os.ttyname(self._slave)
        """Path of the port."""
        self.seconds = 0.0
        """Time of the scene in s, which stops while nobody reads."""

    def frame(self, seconds: float) -> bytes:
        """Bytes of one frame, with random losses and errors."""
        noise = self._rng.normal(0, 2, (ROWS, COLUMNS))
        readings = np.clip(self._rest + noise + 150 * self._scene(seconds), 0, 255).astype(np.uint8)
        sent = np.frombuffer(MARK + readings.tobytes(), np.uint8)
        odd = self._rng.random(len(sent)) < self._wrong
        sent = np.where(odd, self._rng.integers(0, 256, len(sent)), sent).astype(np.uint8)
        return sent[self._rng.random(len(sent)) >= self._lost].tobytes()

    def __enter__(self) -> FlexitacSheet:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stopping.set()
        self._thread.join()
        os.close(self._master)
        os.close(self._slave)

    def _run(self) -> None:
        while not self._stopping.wait(1 / self._hz):
            data = self.frame(self.seconds)
            while data and not self._stopping.is_set():  # as long as nobody reads
                if select.select([], [self._master], [], LOOK_S)[1]:
                    data = data[os.write(self._master, data) :]
            self.seconds += 1 / self._hz
