"""Facts about a board, common to blocking and asynchronous boards."""

from __future__ import annotations

import math
from typing import NoReturn

from contactfpga.driver.events import Silence, checked_deadline
from contactfpga.driver.link import Link
from contactfpga.driver.stats import Stats
from contactfpga.driver.subscription import Events, Subscription
from contactfpga.driver.transport import skins_of
from contactfpga.errors import ContactFPGAError
from contactfpga.skin import Skin
from contactfpga.skin.sheet import Sheet
from contactfpga.wire.faults import Faults
from contactfpga.wire.hello import Hello
from contactfpga.zones.units import UnitHistory


class UnknownSkin(ContactFPGAError, AttributeError):
    """The whole Skin of a board is not known, only its sheet."""


class BoardFacts:
    """An open port, the board's description of itself, and queues of its frames."""

    def __init__(self, link: Link, frames: Subscription, expected: Skin | None):
        self._link, self._frames, self._expected = link, frames, expected

    def __repr__(self) -> str:
        try:
            sheet = self.sheet
        except ContactFPGAError as error:
            return f"<Board {error}>"
        return f"<Board {self.port}: {sheet.rows}x{sheet.columns} cells>"

    def __reduce__(self) -> NoReturn:
        """Refuse copies: closing one would close the port of the original."""
        raise TypeError(f"{self.port}: an open board cannot be copied or sent to another process; open its port there")

    @property
    def port(self) -> str:
        """Name of the port."""
        return self._link.transport.name

    @property
    def live(self) -> bool:
        """Whether a board that answers requests is at the other end, not a recording."""
        return self._link.transport.live

    @property
    def hello(self) -> Hello:
        """The board's last description of itself, sent twice per second."""
        self._link.check_open()
        if self._link.conversation.hello is None:
            raise ContactFPGAError(f"{self.port}: no hello has come yet")
        return self._link.conversation.hello

    @property
    def sheet(self) -> Sheet:
        """Lines, lengths and report of the board's sheet, from its hello."""
        return self.hello.sheet

    @property
    def name(self) -> str:
        """The name in the board's Skin; "" if it has none."""
        return self.hello.name

    @property
    def fingerprint(self) -> bytes:
        """Fingerprint of the Skin from which the board was built."""
        return self.hello.fingerprint

    @property
    def clock_hz(self) -> int:
        """Clock of the board's gateware in Hz."""
        return self.hello.clock_hz

    @property
    def baud(self) -> int:
        """The board's baud rate."""
        return self.hello.baud

    @property
    def skin(self) -> Skin:
        """The board's whole Skin: the one given to :func:`open`, a virtual board's own, or the reference Skin by its
        fingerprint.

        Raises :class:`ContactFPGAError` (also an AttributeError, for ``hasattr``) for any other board, whose hello
        describes only the :attr:`sheet`.
        """
        hello = self.hello
        for skin in (self._expected, *skins_of(self._link.transport), Skin()):
            if skin is not None and skin.fingerprint == hello.fingerprint:
                return skin
        raise UnknownSkin(
            f"{self.port}: of this board's Skin only `board.sheet` is known (fingerprint {hello.fingerprint.hex()}); "
            "give its file: open(port, skin='my.toml')"
        )

    @property
    def faults(self) -> Faults | None:
        """Faults of the lines, reported by the board within 1 ms of a change and after each hello, even without a
        frame. None before the first report, or if the Skin has neither ``guard`` nor ``self_test``.
        """
        self._link.check_open()
        return self._link.conversation.lines.reported

    @property
    def unit_history(self) -> UnitHistory | None:
        """The last readings of the pressure units; None if the board has none."""
        self._link.check_open()
        return self._link.conversation.units.history

    @property
    def silence(self) -> Silence:
        """Time without a frame, since the last frame or since the port was opened, and the last frame."""
        self._link.check_open()
        with self._link.changed:
            return self._link.silence(-math.inf)

    @property
    def stats(self) -> Stats:
        """Counters since the port was opened."""
        stats = self._link.conversation.stats
        stats.dropped = self._frames.dropped
        stats.net = self._link.net
        return stats

    def clock(self) -> float:
        """Seconds on the clock of timeouts: ``time.monotonic``, or simulated time for ``sim://``."""
        return self._link.clock()

    # ---- queues

    def subscribe(self, maxsize: int = 1024, *, deadline_s: float | None = None) -> Subscription:
        """A separate queue for every frame from now on; see :class:`Subscription`.

        With ``deadline_s`` it raises :class:`NoData` when no frame comes for longer. The deadline must allow for the
        longest pause of a working board: a scan and a frame on the wire, or with ``send = "on_change"`` its keep-alive
        and a frame. It has no effect in a recording.
        """
        self._link.check_open()
        deadline_s = None if deadline_s is None else self._checked("deadline_s", deadline_s)
        return Subscription(self._link, maxsize, self, deadline_s)

    def events(self, maxsize: int = 1024, *, deadline_s: float | None = None) -> Events:
        """A separate queue for everything that comes: frames, changes of faults, silence; see :class:`Events`.
        ``deadline_s`` as for :meth:`subscribe`, but silence is an event instead of an error.
        """
        self._link.check_open()
        deadline_s = None if deadline_s is None else self._checked("deadline_s", deadline_s)
        return Events(self._link, maxsize, self, deadline_s)

    def _checked(self, name: str, deadline_s: float) -> float:
        try:
            skin: Skin | None = self.skin
        except ContactFPGAError:
            skin = None
        return checked_deadline(name, deadline_s, self.hello, skin)

    # ---- its end

    def close(self) -> None:
        """Close the port; may be called twice. Calls that wait in other threads raise :class:`BoardClosed`."""
        self._link.close()
