"""The virtual board on a pseudo-terminal, at most in real time."""

from __future__ import annotations

import contextlib
import os
import select
import shlex
import signal
import sys
import termios
import threading
import time
import tty
from collections.abc import Iterator
from pathlib import Path

from contactfpga.design.circuit import Circuit
from contactfpga.design.cover import Cover
from contactfpga.driver.pace import Pace
from contactfpga.errors import ContactFPGAError
from contactfpga.skin import Skin, SkinError
from contactfpga.skin.several import Several, sheets_of
from contactfpga_sim.model.board.virtual import VirtualBoard, VirtualSheets
from contactfpga_sim.model.scenes.scene import Source

CHUNK_S = 0.5e-3
"""Simulated time between two reads of the port."""

MAX_LAG_S = 0.02
"""Largest lag of simulated time that is caught up; what is beyond it stays."""

SLIP_LIMIT = 0.05
"""Share of real time lost in the last seconds above which a report is due."""

SLIP_WINDOW_S = 5.0
"""Seconds between two looks at the share."""

HEADROOM = 0.9
"""Recommended clock as a share of the measured speed."""


class PtyBoard:
    """A virtual board with a port for a serial client.

    The constructor compiles the gateware and opens the port. The board runs in a thread inside ``with PtyBoard(...) as
    board:`` (or from :meth:`start` to :meth:`stop`), or in :meth:`serve`. skin: the board's sheet, or several, which
    the scene touches alike; scene, cover and circuit: as for
    :class:`~contactfpga_sim.model.board.virtual.VirtualBoard`; link: path of a symbolic link to the port. Unread bytes
    are dropped, the oldest first, and counted.
    """

    def __init__(
        self,
        skin: Skin | Several | None = None,
        scene: Source = None,
        link: str | Path | None = None,
        cover: Cover | None = None,
        circuit: Circuit | None = None,
    ):
        self.skins = skin.skins if isinstance(skin, Several) else (skin or Skin(),)
        self._stopping = False  # and no Event, whose lock the handler of a second signal would wait for
        self._thread: threading.Thread | None = None
        # The board keeps its own end of the slave open: without it, a client that leaves would end the terminal.
        self._master, self._slave = os.openpty()
        tty.setraw(self._slave)
        os.set_blocking(self._master, False)
        self.port = os.ttyname(self._slave)
        """Path of the port."""
        self.slip = 0.0
        """Seconds lost for good against real time."""
        self.dropped = 0
        """Number of times the full port was emptied."""
        self.failure: BaseException | None = None
        """Exception that ended the thread; None after :meth:`stop`."""
        self._slip_reported = False
        self._link = Path(link) if link else None
        try:
            if self._link:
                self._make_link(self._link)
            self._board = (
                VirtualSheets(skin, [scene] * len(skin.skins))
                if isinstance(skin, Several)
                else VirtualBoard(skin, scene, cover, circuit)
            )
        except BaseException:
            self._close_port()
            raise

    def clock(self) -> float:
        """Simulated seconds since power-up."""
        return self._board.clock()

    def start(self) -> None:
        """Run the board in a thread until :meth:`stop`."""
        self._thread = threading.Thread(target=self._run_guarded, name="virtual board", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """End the board and its port; an open client is hung up. May be called twice."""
        self._stopping = True
        if self._thread and self._thread is not threading.current_thread():
            self._thread.join()
        if self._master >= 0:
            self._close_port()
            self._board.close()

    def _close_port(self) -> None:
        os.close(self._master)
        os.close(self._slave)
        self._master = self._slave = -1
        if self._link:
            self._remove_link(self._link)

    def __enter__(self) -> PtyBoard:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    def serve(self) -> int:
        """Run in the foreground until SIGINT or SIGTERM. Stdout has the port, stderr all messages."""
        shown = self._link or self.port
        print(shown, flush=True)
        first = str(shown) if len(self.skins) == 1 else f"{shown}#0"
        _say(f"virtual board of {sheets_of(self.skins)} cells; try: contactfpga zones {shlex.quote(first)}")
        _say("Ctrl-C ends it")
        started = time.monotonic()
        try:
            with self._ended_by_signals():
                self._run()
            passed = time.monotonic() - started
            share = min(1.0, self.clock() / passed)
            ran = f"the board ran for {self.clock():.1f} s in {passed:.1f} s of real time ({share:.0%})"
        finally:
            self.stop()
        unread = f"; {self.dropped} times bytes were dropped that nobody had read" if self.dropped else ""
        _say(f"ended: {ran}{unread}")
        return 0

    def _run_guarded(self) -> None:
        try:
            self._run()
        except BaseException as error:  # a thread has nobody to raise it to
            self.failure = error
            _say(f"the virtual board ended: {error}")
            self.stop()  # its client finds the port gone, and does not wait for a board that says nothing

    def _run(self) -> None:
        cycles = max(1, round(CHUNK_S * self.skins[0].clock_hz))
        pace = Pace(self._board.clock(), most_lag_s=MAX_LAG_S)
        looked_s = time.monotonic()
        while not self._stopping:
            ahead = pace.wait_s(self._board.clock())
            self.slip = pace.slip_s
            self._listen(max(0.0, ahead))
            if ahead > 0 and pace.wait_s(self._board.clock()) > 0:
                continue  # woken by a client before it is time
            self._board.advance(cycles)
            self._speak(self._board.read(0))
            if time.monotonic() - looked_s > SLIP_WINDOW_S:
                self._report_slip(1 - pace.share)
                looked_s = time.monotonic()

    def _report_slip(self, share: float) -> None:
        if share > SLIP_LIMIT and not self._slip_reported:
            self._slip_reported = True  # again and again would fill the terminal; the end sums it up
            _say(slip_warning(self.skins[0], share))

    def _listen(self, seconds: float) -> None:
        if select.select([self._master], [], [], seconds)[0]:
            with contextlib.suppress(BlockingIOError):
                self._board.write(os.read(self._master, 4096))

    def _speak(self, data: bytes) -> None:
        while data:
            try:
                data = data[os.write(self._master, data) :]
            except BlockingIOError:
                self.dropped += 1
                termios.tcflush(self._slave, termios.TCIFLUSH)

    def _make_link(self, link: Path) -> None:
        try:
            # What a board left that was killed; any other link is somebody's.
            if link.is_symlink() and os.path.dirname(os.readlink(link)) == os.path.dirname(self.port):
                link.unlink()
            link.symlink_to(self.port)
        except OSError as error:
            self._link = None
            raise ContactFPGAError(f"cannot link {link} to {self.port}: {error.strerror}") from None

    def _remove_link(self, link: Path) -> None:
        with contextlib.suppress(OSError):  # gone, or no link
            if os.readlink(link) == self.port:
                link.unlink()

    @contextlib.contextmanager
    def _ended_by_signals(self) -> Iterator[None]:
        def end(*_: object) -> None:
            self._stopping = True

        before = {number: signal.signal(number, end) for number in (signal.SIGINT, signal.SIGTERM)}
        try:
            yield
        finally:
            for number, handler in before.items():
                signal.signal(number, handler)


def slip_warning(skin: Skin, share: float) -> str:
    """Warning that this share of real time slips."""
    held = 1 - share
    clock_hz = clock_that_holds(skin, held * skin.clock_hz)
    advice = (
        f"with clock_hz = {clock_hz} in its Skin, this computer would keep up"
        if clock_hz
        else f"a clock with which this computer keeps up does not go with baud = {skin.baud} and the rest of this Skin"
    )
    pace = (
        f"one second of the board takes {1 / held:.1f} s, and times are the board's" if held > 0 else "it stands still"
    )
    return f"this computer simulates the board slower than real time ({held:.0%}): {pace}; {advice}"


def clock_that_holds(skin: Skin, cycles_per_second: float) -> int | None:
    """Fastest possible clock of the Skin in Hz that a machine of this speed simulates in real time."""
    for megahertz in range(int(HEADROOM * cycles_per_second / 1e6), 0, -1):
        with contextlib.suppress(SkinError):
            return skin.replace(clock_hz=megahertz * 1_000_000).clock_hz
    return None


def _say(text: str) -> None:
    print(f"contactfpga: {text}", file=sys.stderr, flush=True)
