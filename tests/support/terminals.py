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

    def wait(self):
        status = self.process.wait()
        self._reader.join()
        os.close(self._master)
        return status


def on_terminal(arguments, columns, **variables):
    """Status and output of a contactfpga command on a terminal so wide."""
    terminal = OnTerminal([sys.executable, "-m", "contactfpga.tools.cli", *map(str, arguments)], columns, **variables)
    return terminal.wait(), terminal.said
