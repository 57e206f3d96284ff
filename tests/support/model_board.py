"""A board as docs/protocol.md has it, without a line or straight at a conversation: it counts and keeps time."""

from wire import EPOCH_US, Wire, taken_in

import contactfpga
from contactfpga.driver.conversation import Conversation, frames_in
from contactfpga_sim.model.golden.request import heard
from contactfpga_sim.model.golden.uart import pulsed

ZONE = (4, 10, 6)
"""The zone it reports unless told otherwise: area, sum x, sum y."""

SCAN_US = 96

CHUNK = 700
"""Bytes that a read of :class:`DirectPort` returns at most."""


class ModelBoard:
    """``frame()`` and ``hello()`` are what it sends next; ``hear()`` takes what the host sent."""

    def __init__(self, skin):
        self.wire = Wire(skin)
        self.moments = [ZONE]
        self.commanded = []  # (what, value) of each command taken
        self.power_up()

    def power_up(self):
        self.sent = 0
        self.time_us = SCAN_US  # of the next frame's first sample, since power-up
        self.heard = 0
        self.overwritten = 0
        self.stuck = 0
        self.word = 0  # what it knows of its lines
        self.repeated = None  # the number that a hello repeats, where what follows a request may hide it
        self._taken = 0
        self._heard_bytes = b""

    def frame(self, flags=(), **options) -> bytes:
        """The next frame; every one counts."""
        options = {
            "sequence": self.sent,
            "time": self.time_us,
            "heard": self.heard,
            "overwritten": self.overwritten,
        } | options
        self.sent += 1
        self.time_us += SCAN_US
        if self.wire.skin.report == "cells":
            row = [column % 2 for column in range(self.wire.skin.columns)]
            return self.wire.cells([row] * self.wire.skin.rows, flags=flags, **options)
        return self.wire.zones(self.moments, flags=flags, **options)

    def hello(self, **options) -> bytes:
        number = self.heard if self.repeated is None else self.repeated
        state = {"sent": self.sent, "epoch": self.time_us // EPOCH_US, "heard": number, "stuck": self.stuck}
        return self.wire.hello(**state | options)

    def report(self) -> bytes:
        return self.wire.report(self.word)

    def hear(self, data) -> list:
        """(number, whether a hello is asked for) of the requests that these bytes complete."""
        if pulsed(self.wire.known.bit_clocks):
            return self._hear_pulses(data)
        *packets, self._heard_bytes = (self._heard_bytes + data).split(b"\0")
        found = taken_in(packets)
        for number, _, command in found:
            if command is None or self.wire.commands:
                self.heard = number
                self.commanded += [] if command is None else [command]
        return [one[:2] for one in found]

    def _hear_pulses(self, data) -> list:
        self._heard_bytes += data
        found = heard([(0, self._heard_bytes)], self.wire.known.bit_clocks, bool(self.wire.commands))
        self.commanded = [one.command for one in found.requests if one.command is not None]
        new = [(one.number, one.hello) for one in found.requests][self._taken :]
        self._taken += len(new)
        for number, _ in new:
            self.heard = number
        self.repeated = found.numbers[-1][1] if found.numbers else 0
        return new


class DirectPort(ModelBoard):
    """A port in simulated time, as ``contactfpga.open`` takes it, that answers each request at once, in pieces."""

    def __init__(self, skin):
        super().__init__(skin)
        self._out = b""
        self._seconds = 0.0

    def write(self, data):
        for _, hello in self.hear(data):
            self._out += (self.hello() if hello else b"") + self.frame()

    def send(self, data):
        """Say something without being asked."""
        self._out += data

    def read(self, seconds):
        data, self._out = self._out[:CHUNK], self._out[CHUNK:]
        self._seconds += 0.0 if data else seconds
        return data

    def clock(self):
        return self._seconds

    def close(self):
        pass


SKIN = contactfpga.Skin()


class Line:
    """A board whose bytes go straight to a conversation."""

    def __init__(self, skin=SKIN, live=True, expected=None):
        self.board = ModelBoard(skin)
        self.host = Conversation("x", expected, live)
        self.now = 0.0

    def give(self, *packets):
        """Frames that the host passes on of these bytes."""
        return frames_in(self.host.receive(b"".join(packets), self.now))

    def hello(self, **options):
        return self.host.receive(self.board.hello(**options), self.now)

    def frame(self, **options):
        return self.give(self.board.frame(**options))

    def pause(self, seconds):
        """Nothing is sent, and nothing received."""
        self.board.time_us += round(seconds * 1e6)
        self.now += seconds

    @property
    def stats(self):
        return self.host.stats
