"""Publishers and routers in processes of their own, on free ports of this machine."""

import contextlib
import os
import socket
import subprocess
import sys
import threading
import time

from fake_board import FakeBoard

CHUNK = 4096
"""Bytes that a cable takes at once."""

LONG_S = 60.0
"""How long a busy machine may let a process wait."""

ROUTER = """
import sys, time
from contactfpga.robot.net import session
with session.listening(sys.argv[1]):
    print("ready", flush=True)
    time.sleep(600)
"""


PUBLISHER = """
import sys
from contactfpga.__main__ import main
sys.exit(main())
"""


def free_endpoint(protocol="tcp"):
    """A port that nobody listens on."""
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return f"{protocol}/127.0.0.1:{one.getsockname()[1]}"


PATIENCE = f"""
from contactfpga.robot import net
import contactfpga.robot.net.port, contactfpga.robot.net.session
net.port.FOUND_S, net.session.CONNECT_MS, net.session.LEASE_MS = {LONG_S}, {LONG_S:.0f}_000, {LONG_S:.0f}_000
"""
"""How a program begins that waits long for others."""


def wait_long(monkeypatch):
    """The same for this process: who is there is found, connected and kept, however late."""
    from contactfpga.robot.net import port, session

    monkeypatch.setattr(port, "FOUND_S", LONG_S)
    monkeypatch.setattr(session, "CONNECT_MS", round(1000 * LONG_S))
    monkeypatch.setattr(session, "LEASE_MS", round(1000 * LONG_S))


def patient(port):
    """The ``zenoh://`` port, for a reader that waits long for a publisher that the machine lets wait."""
    return f"{port}{'&' if '?' in port else '?'}wait={LONG_S:.0f}"


def assert_loopback_alone(pid):
    """It listens, and nobody outside this machine can reach it."""
    import psutil  # which not every computer has

    found = psutil.Process(pid).net_connections("inet")
    assert [one for one in found if one.status == "LISTEN"], "the test sees where it listens"
    assert {one.laddr.ip for one in found} == {"127.0.0.1"}


class Child:
    """A process of Python; ``line`` is the first that it prints."""

    def __init__(self, *arguments, wait=True):
        self.process = subprocess.Popen(
            [sys.executable, *map(str, arguments)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )
        self.line = self.process.stdout.readline().strip() if wait else ""

    def end(self):
        """Kill it; what it said."""
        with contextlib.suppress(ProcessLookupError):
            self.process.kill()
        return self.process.communicate(timeout=LONG_S)[1]

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.end()


def router(endpoint):
    """A Zenoh session that is nothing but a router."""
    return Child("-c", PATIENCE + ROUTER, endpoint)


def publish(port, *options, others=(), wait=True):
    """``contactfpga publish`` of a port and others."""
    arguments = ("publish", port, *others, "--timeout", LONG_S, *options)
    return Child("-c", PATIENCE + PUBLISHER, *arguments, wait=wait)


class Streaming(FakeBoard):
    """Some hundred frames per second, and hellos; its clock is that of the host, and ``sent`` holds their times."""

    waits = False

    def __init__(self, skin, every_s=0.005):
        super().__init__(skin)
        self._every_s = every_s
        self.sent_us = set()
        self.begun_s = time.monotonic()
        self._hello_due_s = 0.0
        self.lock = threading.Lock()
        self.stream = self._more

    def frame(self, *args, **options):
        now_us = round((time.monotonic() - self.begun_s) * 1e6)
        self.time_us = max(self.time_us, now_us)
        self.sent_us.add(self.time_us)
        return super().frame(*args, **options)

    def _more(self):
        time.sleep(self._every_s)
        data = b""
        if time.monotonic() > self._hello_due_s:
            data, self._hello_due_s = self.hello(), time.monotonic() + 0.25
        return data + self.frame()

    def _write(self, data):
        """A line does not wait: what nobody reads is lost, as in a UART; but where a test wants every frame to come."""
        if self.waits:
            super()._write(data)
            return
        with contextlib.suppress(BlockingIOError):
            os.write(self._master, data)


class Relay:
    """A cable between a program and an endpoint that carries ``bytes_s`` per second, with little memory."""

    def __init__(self, endpoint, bytes_s):
        self.bytes_s = bytes_s
        host, _, number = endpoint.partition("/")[2].rpartition(":")
        self._target = host, int(number)
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.endpoint = f"tcp/127.0.0.1:{self._listener.getsockname()[1]}"
        self._sockets, self._carriers = [], []
        self._server = threading.Thread(target=self._serve, daemon=True)
        self._server.start()

    def _serve(self):
        with contextlib.suppress(OSError):
            while True:
                near, _ = self._listener.accept()
                far = socket.socket()
                far.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, CHUNK)
                try:
                    far.connect(self._target)
                except OSError:  # nobody listens there now
                    near.close()
                    far.close()
                    continue
                self._sockets += [near, far]
                for source, sink in ((near, far), (far, near)):
                    self._carriers.append(threading.Thread(target=self._carry, args=(source, sink), daemon=True))
                    self._carriers[-1].start()

    def _carry(self, source, sink):
        with contextlib.suppress(OSError):
            while data := source.recv(CHUNK):
                sink.sendall(data)
                time.sleep(len(data) / self.bytes_s)
            sink.shutdown(socket.SHUT_RDWR)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        with contextlib.suppress(OSError):
            self._listener.shutdown(socket.SHUT_RDWR)  # ends its thread, which may just be opening more
        self._server.join()
        for one in self._sockets:
            with contextlib.suppress(OSError):
                one.shutdown(socket.SHUT_RDWR)
        for one in self._carriers:
            one.join()
        for one in (self._listener, *self._sockets):
            one.close()
