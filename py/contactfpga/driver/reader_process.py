"""The process that reads a port, as the one that started it sees it: its start, its socket and its end."""

from __future__ import annotations

import contextlib
import json
import os
import pickle
import socket
import subprocess
import sys
from pathlib import Path

from contactfpga.driver.reader import LONGEST_MESSAGE, MEMORY_BYTES, Shared
from contactfpga.errors import ContactFPGAError
from contactfpga.skin import Skin

START_S = 60.0
"""How long the process may take to start, on a machine that is busy."""
END_S = 5.0
"""How long it may take to give the port back."""

_CODE = """import json, sys
numbers, sys.path[:] = json.loads(sys.argv[1])
from contactfpga.driver.reader import main
main(*numbers)"""


class ReaderProcess:
    """The process, its socket and the memory that it writes."""

    def __init__(self, name: str, baud: int, skin: Skin | None, record: str | Path | None):
        memory = os.memfd_create("contactfpga", os.MFD_CLOEXEC)
        try:
            os.ftruncate(memory, MEMORY_BYTES)
            self.shared = Shared.of(memory)
            self.wake = os.eventfd(0, os.EFD_CLOEXEC | os.EFD_NONBLOCK)
            self.control, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
            with theirs:
                numbers = theirs.fileno(), memory, self.wake
                command = [sys.executable, "-c", _CODE, json.dumps([numbers, sys.path]), f"reader of {name}"]
                self.process = subprocess.Popen(
                    command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, pass_fds=numbers
                )
        finally:
            os.close(memory)
        try:
            self._begin(name, pickle.dumps((os.getpid(), name, baud, skin, record)))
        except BaseException:
            self.end()
            raise

    def _begin(self, name: str, asked: bytes) -> None:
        self.control.send(asked)
        self.control.settimeout(START_S)
        try:
            answer = self.control.recv(LONGEST_MESSAGE)
        except TimeoutError:
            answer = b""
        if not answer:
            raise ContactFPGAError(
                f"{name}: its reader process did not start within {START_S:g} s; open it with reader='thread'"
            )
        told = pickle.loads(answer)
        if isinstance(told, Exception):
            raise told
        self.begun_s: float = told

    def send(self, *message: object) -> None:
        """Tell it something; nothing where it has ended."""
        with contextlib.suppress(OSError):
            self.control.send(pickle.dumps(message))

    def end(self) -> Exception | None:
        """Have it give the port back, and end; returns what went wrong with that."""
        told = b""
        self.send("close")
        with contextlib.suppress(OSError):
            self.control.settimeout(END_S)
            told = self.control.recv(LONGEST_MESSAGE)
        self.control.close()
        try:
            self.process.wait(END_S)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        os.close(self.wake)
        found: Exception | None = pickle.loads(told) if told else None
        return found

    def disown(self) -> None:
        """In a child of this process: it is the parent's."""
        self.control.close()
        os.close(self.wake)
        self.process.returncode = 0
