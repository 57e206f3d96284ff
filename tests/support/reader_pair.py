"""The two readers of a port side by side, in one process and with one clock, so that all they say can be compared: the
one decodes in Python alone, the other in C."""

import random

from contactfpga.driver import native
from contactfpga.driver.link import Link
from contactfpga.driver.native import Port
from contactfpga.driver.native_link import NativeLink
from contactfpga.wire import table


class Line:
    """A port whose bytes a test hands over, at a time of its own."""

    live = threaded = True

    def __init__(self, now):
        self.name = "the line"
        self.clock = now
        self.sent = b""
        self.rng = random.Random(5)

    def write(self, data):
        self.sent += data

    def close(self):
        pass


class NativeLine(Line):
    """The same, with what decodes it in C."""

    def __init__(self, now):
        super().__init__(now)
        self.core = Port(-1, now())

    def close(self):
        self.core.close()


class Pair:
    """Both links; :attr:`now` is their time."""

    def __init__(self, skin=None):
        self.now = 0.0
        self.lines = Line(self._now), NativeLine(self._now)
        self.thread = Link(self.lines[0], skin)
        self.thread.conversation.decode = table.decode
        self.native = NativeLink(self.lines[1], self.lines[1], skin)

    def _now(self):
        return self.now

    @property
    def links(self):
        return self.thread, self.native

    def take(self, data):
        """Both get these bytes; the native one does not look at them yet."""
        for start in range(0, len(data), native.CHUNK):
            piece = data[start : start + native.CHUNK]
            self._take(piece)
            self.native._core.feed(piece, self.now)

    def pass_time(self):
        """Nothing came until now."""
        self._take(b"")
        self.native.catch_up()
        self.native._send()

    def _take(self, data):
        with self.thread.changed:
            self.thread._take(data)
        self.thread._send()

    def sent(self):
        """What both sent to the board since the last call, which is the same."""
        self.pass_time()
        first, second = (line.sent for line in self.lines)
        assert first == second
        for line in self.lines:
            line.sent = b""
        return first

    def close(self):
        self.native.close()
