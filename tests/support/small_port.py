"""A board behind a port with little memory, as a publisher takes it; in the process of the test."""

import contextlib
import threading
import time

from model_board import ModelBoard

import contactfpga
from contactfpga.robot.net.publisher import BoardPublisher


class SmallPort(ModelBoard):
    """A board behind a port with little memory: what does not find room is lost, frame by frame. It answers requests,
    and sends frames and hellos by itself after :meth:`go`."""

    threaded = True

    def __init__(self, skin=None):
        super().__init__(skin or contactfpga.Skin())
        self._rate_hz = 0.0
        self.port_bytes = 4096
        self.overflowed = 0
        self._kept, self._begun_s = b"", time.monotonic()
        self._due_s = self._hello_due_s = 0.0
        self._lock = threading.Lock()

    def go(self, rate_hz):
        """From now on, so many frames per second."""
        with self._lock:
            self._rate_hz, self._due_s = rate_hz, time.monotonic()

    def _fill(self):
        now_s = time.monotonic()
        while self._rate_hz and self._due_s < now_s:
            if self._due_s > self._hello_due_s:
                self._hello_due_s = now_s + 0.5
                self._kept += self.hello()
            self._due_s = max(self._due_s + 1 / self._rate_hz, now_s - 0.5)
            self._send(1)

    def _send(self, count):
        self.time_us = max(self.time_us, round((time.monotonic() - self._begun_s) * 1e6))
        data = b"".join(self.frame() for _ in range(count))
        if len(self._kept) + len(data) <= self.port_bytes:
            self._kept += data
        else:
            self.overflowed += count

    def say_hello(self):
        with self._lock:
            self._kept += self.hello()

    def write(self, data):
        with self._lock:
            for _, hello in self.hear(data):
                self._kept += self.hello() if hello else b""
                self._send(1)

    def read(self, timeout_s):
        until_s = time.monotonic() + timeout_s
        while True:
            with self._lock:
                self._fill()
                data, self._kept = self._kept, b""
            if data or time.monotonic() >= until_s:
                return data
            time.sleep(0.002)

    def clock(self):
        return time.monotonic()


@contextlib.contextmanager
def published(source, network, key, **options):
    """A publisher in a thread of its own; it may be ended before the block's end."""
    stop = threading.Event()
    publisher = BoardPublisher(source, network, key, **options)
    thread = threading.Thread(target=publisher.run, args=(stop,))
    thread.start()

    def end():
        stop.set()
        thread.join()

    publisher.end = end
    try:
        yield publisher
    finally:
        end()
