"""A board in Python behind a pseudo-terminal, which misbehaves where a test wants it to."""

import contextlib
import fcntl
import os
import pty
import select
import struct
import termios
import threading
import time
import tty

from model_board import ZONE as ZONE
from model_board import ModelBoard


def wait_until(condition, pause_s=0.002):
    """The test's own timeout ends it if the condition never comes: a busy machine may take long."""
    while not condition():
        time.sleep(pause_s)


def patiently(attempt, enough, timeouts_s=(1.0, 6.0, 60.0)):
    """What ``attempt(timeout_s)`` returns, as soon as that is ``enough``, with one timeout after the other: a busy
    machine may let a short one pass before anything came."""
    for timeout_s in timeouts_s:
        found = attempt(timeout_s)
        if enough(found):
            break
    return found


@contextlib.contextmanager
def background(function):
    """Runs a function beside the block; what it raises is raised at the block's end."""
    failures = []

    def guarded():
        try:
            function()
        except BaseException as error:
            failures.append(error)

    thread = threading.Thread(target=guarded)
    thread.start()
    try:
        yield
    finally:
        thread.join()
    if failures:
        raise failures[0]


class FakeBoard(ModelBoard):
    """Answers each request with a frame, and with a hello before it where one is asked for; ``path`` is its port."""

    def __init__(self, skin, link=None):
        super().__init__(skin)
        self.answers = True
        self.hello_s = 0.0  # says hello so often without being asked; 0: never
        self.stream = b""  # sent over and over, as fast as the port takes it; or a function that makes more
        self.slice = 1 << 16  # bytes written at once
        self.asked = 0
        self._master, self._slave = pty.openpty()
        tty.setraw(self._slave)
        os.set_blocking(self._master, False)
        self.path = os.ttyname(self._slave)
        if link is not None:
            link.unlink(missing_ok=True)
            link.symlink_to(self.path)
            self.path = str(link)
        self._stop = threading.Event()
        self._lock = threading.Lock()
        self._thread = threading.Thread(target=self._serve, daemon=True)
        self._thread.start()

    def send(self, data: bytes):
        with self._lock:
            for start in range(0, len(data), self.slice):
                if start:
                    time.sleep(0.001)
                self._write(data[start : start + self.slice])

    def waiting(self) -> int:
        """Bytes in the port that its client has not read."""
        return struct.unpack("i", fcntl.ioctl(self._slave, termios.FIONREAD, bytes(4)))[0]

    def unplug(self):
        self._stop.set()
        self._thread.join()
        os.close(self._master)
        os.close(self._slave)

    def close(self):
        if not self._stop.is_set():
            self.unplug()

    def _write(self, data: bytes):
        while data and not self._stop.is_set():
            _, ready, _ = select.select([], [self._master], [], 0.05)
            if ready:
                data = data[os.write(self._master, data) :]

    def _serve(self):
        due = 0.0
        while not self._stop.is_set():
            if self.hello_s and time.monotonic() >= due and not self.waiting():
                due = time.monotonic() + self.hello_s
                self.send(self.hello())
            ready, _, _ = select.select([self._master], [], [], 0 if self.stream else 0.005)
            if ready:
                answers, heard = self.answers, self.hear(os.read(self._master, 100))
                self.asked += len(heard)
                if answers and heard:
                    self.send((self.hello() if any(hello for _, hello in heard) else b"") + self.frame())
            elif self.stream:
                _, writable, _ = select.select([], [self._master], [], 0.005)
                if writable:
                    with self._lock:
                        self._write(self.stream() if callable(self.stream) else self.stream)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()
