"""The two readers of a port side by side, in one process and with one clock, so that all they say can be compared."""

import os
import random

from contactfpga.driver import reader, remote
from contactfpga.driver.link import Link


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


class NoProcess:
    """What does the work of the process that reads, when it is told to."""

    def __init__(self, line, skin=None):
        memory = os.memfd_create("test")
        os.ftruncate(memory, reader.MEMORY_BYTES)
        self.shared = reader.Shared.of(memory)
        os.close(memory)
        self.wake = os.eventfd(0, os.EFD_NONBLOCK)
        self.link = reader.ReaderLink(line, skin, self.shared, self.wake)
        self.control = self

    def fileno(self):
        return -1

    def send(self, what, *arguments):
        with self.link.changed:
            reader._do(self.link, what, list(arguments))
        self.link._send()

    def end(self):
        os.close(self.wake)


class Pair:
    """Both links; :attr:`now` is their time."""

    def __init__(self, skin=None):
        self.now = 0.0
        self.lines = [Line(lambda: self.now) for _ in range(2)]
        self.thread = Link(self.lines[0], skin)
        self.process = NoProcess(self.lines[1], skin)
        self.remote = remote.RemoteLink("the line", self.process)
        self.remote.transport.clock = lambda: self.now

    @property
    def links(self):
        return self.thread, self.remote

    def take(self, data):
        """Both get these bytes."""
        for link in (self.thread, self.process.link):
            with link.changed:
                link._take(data)
            link._send()

    def sent(self):
        """What both sent to the board since the last call, which is the same."""
        first, second = (line.sent for line in self.lines)
        assert first == second
        for line in self.lines:
            line.sent = b""
        return first

    def close(self):
        self.remote.close()
