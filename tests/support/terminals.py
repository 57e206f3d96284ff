"""Commands on a pseudo-terminal of a given size, and commands that are interrupted."""

import contextlib
import fcntl
import os
import pty
import signal
import struct
import subprocess
import sys
import termios
import threading
import time


def environment(**changes):
    """Of a child: as this process has it, but for what says something of a terminal."""
    names = ("COLUMNS", "LINES", "NO_COLOR", "FORCE_COLOR", "PYTHONIOENCODING", "TTY_COMPATIBLE", "TTY_INTERACTIVE")
    kept = {name: value for name, value in os.environ.items() if name not in names}
    return kept | {"TERM": "xterm-256color"} | changes


def listening():
    """In a child, before it starts: signals end it that a shell has its background ignore, or nohup what it starts."""
    for number in (signal.SIGINT, signal.SIGHUP, signal.SIGTERM):
        signal.signal(number, signal.SIG_DFL)


class OnTerminal:
    """A command in a terminal of its own, with nothing redirected, as a shell starts it."""

    def __init__(self, command, columns, lines=24, **variables):
        self._master, slave = pty.openpty()
        fcntl.ioctl(slave, termios.TIOCSWINSZ, struct.pack("HHHH", lines, columns, 0, 0))

        def own():
            os.setsid()
            fcntl.ioctl(0, termios.TIOCSCTTY, 0)
            listening()

        streams = {"stdin": slave, "stdout": slave, "stderr": slave}
        self.process = subprocess.Popen(command, **streams, preexec_fn=own, env=environment(**variables))
        os.close(slave)
        self._bytes = bytearray()
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self):
        with contextlib.suppress(OSError):
            while data := os.read(self._master, 65536):
                self._bytes += data

    @property
    def said(self):
        return self._bytes.decode(errors="replace").replace("\r\n", "\n")

    def type(self, text):
        os.write(self._master, text.encode())

    def wait(self, seconds=60):
        status = self.process.wait(seconds)
        self._reader.join(2)
        os.close(self._master)
        return status


def on_terminal(arguments, columns, seconds=120, **variables):
    """Status and output of a contactfpga command on a terminal so wide."""
    terminal = OnTerminal([sys.executable, "-m", "contactfpga.tools.cli", *map(str, arguments)], columns, **variables)
    return terminal.wait(seconds), terminal.said


def descendants(pid):
    """Every process below this one: {pid: command line}."""
    parents, lines = {}, {}
    for name in os.listdir("/proc"):
        if name.isdigit():
            with contextlib.suppress(OSError):
                with open(f"/proc/{name}/stat") as file:
                    rest = file.read().rpartition(")")[2].split()
                if rest[0] != "Z":
                    parents[int(name)] = int(rest[1])
                    with open(f"/proc/{name}/cmdline", "rb") as file:
                        lines[int(name)] = file.read().replace(b"\0", b" ").decode(errors="replace")
    below, found = {pid}, {}
    while new := {child for child, parent in parents.items() if parent in below and child not in below}:
        below |= new
        found |= {child: lines.get(child, "") for child in new}
    return found


def alive(pids):
    """Those of the processes that still run."""
    left = []
    for pid in pids:
        with contextlib.suppress(OSError):
            with open(f"/proc/{pid}/stat") as file:
                if file.read().rpartition(")")[2].split()[0] != "Z":
                    left.append(pid)
    return left


def wait_for(condition, seconds=60):
    until = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < until, "did not come about"
        time.sleep(0.05)
