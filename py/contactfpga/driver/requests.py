"""Assignment of frames to the requests that they answer (docs/protocol.md, Conversation)."""

from __future__ import annotations

import collections
import enum
import random

from contactfpga.skin.derived import HEARD_BITS
from contactfpga.wire import protocol
from contactfpga.wire.command import Command, encode_command

MOST_APART = 5
"""Most steps of the last sent number beyond the last one in a frame for another request: frames on their way then have
at most six numbers, and low bits distinguish seven.
"""

_LOWS = (1 << HEARD_BITS) - 1
"""Largest value of a number's lowest bits, which cycle through 1 to this."""
_NUMBERS = 1 << protocol.DIGIT_BITS * protocol.HEARD_DIGITS


class _Stage(enum.Enum):
    UNKNOWN = "nothing is known of what is on its way"
    GREETING = "a hello shall repeat the number"
    ECHOING = "a hello has repeated the number, a frame shall carry its lowest bits"
    KNOWN = "frames on their way carry numbers from the last one seen to the last one sent"


class Requests:
    """Numbers requests, and tells which ones a frame answers.

    Each caller gets a ticket, counted from 1; one request may serve several. A command is a request with a ticket of
    its own: until its answer nothing else is sent.
    """

    def __init__(self, rng: random.Random | None = None):
        self.retry_s = 0.5
        """Time after which an unanswered request is repeated for its caller."""
        self.pulsed: bool | None = None
        """Whether the board reads pulses; None: unknown, so both forms are sent."""
        self.answered = 0
        """Highest answered ticket."""
        self.answered_sent_s = 0.0
        self._rng = rng or random.SystemRandom()
        self._out = bytearray()
        self._stage = _Stage.UNKNOWN
        self._tickets = 0
        self._asked = 0  # all tickets up to this one have a request that was sent since the stage is known
        self._until = 0.0
        self._sent_at = 0.0
        self._number = 0
        self._step = self._seen = 0  # of the numbers last sent and last seen, counted
        self._stands_for: dict[int, tuple[int, float]] = {}  # step: ticket, and when it was sent
        self._command: Command | None = None
        self._commanding = 0  # its ticket
        self._command_until = 0.0
        self._in_flight = False  # the command was sent since the stage is known
        self._recent: collections.deque[int] = collections.deque(maxlen=MOST_APART + 1)

    @property
    def idle(self) -> bool:
        return self._tickets == self.answered

    def ask(self, now: float, until: float, hello: bool = False) -> int:
        """Ticket for a frame scanned after ``now``; the caller waits until ``until``. ``hello``: request one as
        well.
        """
        self._tickets += 1
        self._until = max(self._until, until)
        if not self._in_flight:
            self._send(now, hello)
        return self._tickets

    def command(self, command: Command, now: float, until: float) -> int:
        """Ticket for a frame scanned after the board took this command, perhaps twice if an answer is lost; one at a
        time.
        """
        assert self._command is None, "one command at a time"
        self._tickets += 1
        self._command, self._commanding, self._command_until = command, self._tickets, until
        self._until = max(self._until, until)
        self._send(now, hello=False)
        return self._tickets

    def end_command(self) -> None:
        self._command, self._in_flight = None, False

    def poll(self, now: float, hello: bool = False) -> None:
        """Repeat a request whose answer is overdue."""
        if self._tickets > self.answered and now < self._until and now >= self._sent_at + self.retry_s:
            self._send(now, hello)

    def data_to_send(self) -> bytes:
        data = bytes(self._out)
        self._out.clear()
        return data

    def sent_since(self, number: int, moment: float) -> bool:
        """Whether this is the last number, sent since ``moment``."""
        return number == self._number and self._sent_at >= moment

    def take_hello(self, heard: int, pulsed: bool, now: float) -> None:
        """Take a hello that repeats this number; ``pulsed``: the board reads pulses."""
        learned, self.pulsed = pulsed and not self.pulsed, pulsed
        if self._stage is not _Stage.GREETING:
            return
        if heard == self._number:
            self._stage = _Stage.ECHOING
        elif learned and self._tickets > self.answered:  # the other form, which came last, hid the number
            self._put(self._random(), now, hello=True)

    def take_frame(self, heard: int, now: float) -> None:
        """Take the lowest bits of a number in a frame."""
        if self._stage is _Stage.ECHOING and heard == _low(self._number):
            self._stage = _Stage.KNOWN
            self._step = self._seen = 0
            self._stands_for.clear()
            if self._tickets > self.answered:
                self._send_next(now, hello=False)
        elif self._stage is _Stage.KNOWN and heard:
            step = self._step - (_low(self._number) - heard) % _LOWS
            if step < self._seen:  # no request of ours: someone else speaks to the board
                self._stage, self._in_flight = _Stage.UNKNOWN, False
                return
            for known in range(self._seen, step + 1):
                ticket, sent_s = self._stands_for.pop(known, (0, 0.0))
                if ticket > self.answered:
                    self.answered, self.answered_sent_s = ticket, sent_s
            self._seen = step
            if self._command is not None and self._commanding <= self.answered:
                self.end_command()
            if self._tickets > self._asked and not self._in_flight:
                self._send(now, hello=False)

    def _send(self, now: float, hello: bool) -> None:
        if self._stage is _Stage.KNOWN and self._step - self._seen <= MOST_APART:
            self._send_next(now, hello)
        elif self._stage is _Stage.UNKNOWN or now >= self._sent_at + self.retry_s:
            self._stage, self._in_flight = _Stage.GREETING, False
            self._put(self._random(), now, hello=True)

    def _send_next(self, now: float, hello: bool) -> None:
        number = self._number + 1
        while not protocol.may_number(number % _NUMBERS):
            number += 1
        self._step += 1
        self._stands_for[self._step] = self._tickets, now
        self._asked = self._tickets
        self._in_flight = self._command is not None and now < self._command_until
        self._put(number % _NUMBERS, now, hello, self._command if self._in_flight else None)

    def _put(self, number: int, now: float, hello: bool, command: Command | None = None) -> None:
        self._number, self._sent_at = number, now
        self._recent.append(_low(number))
        for pulsed in (True, False):  # last what most boards read: whatever follows a request hides its number
            if self.pulsed in (None, pulsed):
                if command is None:
                    self._out += protocol.encode_request(number, hello, pulsed)
                else:
                    self._out += encode_command(number, command, hello, pulsed)

    def _random(self) -> int:
        """A random number whose lowest bits and then the next ones are no recent sequence: frames that the hello
        overtook cannot carry them.
        """
        recent = list(self._recent)
        while True:
            number = self._rng.randrange(_NUMBERS)
            low = _low(number)
            after = recent[recent.index(low) + 1 :] if low in recent else []
            if protocol.may_number(number) and low % _LOWS + 1 not in after:
                return number


def _low(number: int) -> int:
    return number & (1 << HEARD_BITS) - 1
