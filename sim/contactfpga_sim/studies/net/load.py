"""Runs links through a router, in three processes: boards with their publishers, the router, and who reads them all."""

from __future__ import annotations

import multiprocessing
import random
import socket
import threading
import time
from contextlib import ExitStack
from multiprocessing.connection import Connection
from typing import Any, NamedTuple

import numpy as np

import contactfpga
from contactfpga.net import session
from contactfpga.net.publisher import Publisher
from contactfpga_sim.studies.net import source

SECONDS = 5.0
FULL_HZ = 10_000.0
"""The rate of one link beside the others."""
RATE_HZ = 1000.0
BARE_BYTES = 100
"""Of a message of the bare pair."""
LONG_S = 120.0


class Load(NamedTuple):
    """What a run showed; times in s."""

    links: int
    frames: int
    """Received, per second."""
    lost: int
    """Frames and messages that did not come."""
    messages: float
    """Per second."""
    cpu: dict[str, float]
    """Share of a core that publishers, router and readers took."""
    latency: tuple[float, float]
    """p50 and p99 from a frame being due at the port to its reader, of one link."""
    bare: tuple[float, float]
    """The same of the bare pair of Zenoh, from put to callback."""


def measure(links: int, batch_s: float, full: bool = False, seconds: float = SECONDS) -> Load:
    """Links of 1 kHz; ``full``: and one of 10 kHz."""
    context: Any = multiprocessing.get_context("spawn")
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        endpoint = f"tcp/127.0.0.1:{one.getsockname()[1]}"
    with ExitStack() as stack:
        pipes = {}
        for name, work in (("router", _route), ("publishers", _publish), ("readers", _read)):
            pipes[name], theirs = context.Pipe()
            arguments = (theirs, endpoint, links + full, batch_s, full, seconds)
            process = context.Process(target=work, args=arguments, daemon=True)
            process.start()
            stack.callback(process.kill)
            assert _answer(pipes[name]) == "ready"
        for pipe in pipes.values():
            pipe.send("go")
        begun_s, firsts = _answer(pipes["publishers"])
        pipes["readers"].send((begun_s, firsts[0]))
        found = {name: _answer(pipe) for name, pipe in pipes.items()}
    frames, lost, messages, latency, bare = found["readers"][1:]
    cpu = {name: value[0] / seconds for name, value in found.items()}
    return Load(links + full, round(frames / seconds), lost, messages / seconds, cpu, latency, bare)


def _answer(pipe: Connection) -> Any:
    if not pipe.poll(LONG_S):
        raise TimeoutError("a process of the study does not answer")
    return pipe.recv()


def _route(pipe: Connection, endpoint: str, *_: object) -> None:
    seconds = _[-1]
    assert isinstance(seconds, float)
    with session.listening(endpoint):
        pipe.send("ready")
        pipe.recv()
        used_s = time.process_time()
        time.sleep(seconds)
        pipe.send((time.process_time() - used_s,))
        time.sleep(LONG_S)


def _publish(pipe: Connection, endpoint: str, links: int, batch_s: float, full: bool, seconds: float) -> None:
    for low in range(8):
        source.frames(low)
    boards = [source.Steady() for _ in range(links)]
    with session.connected(endpoint) as network:
        stop = threading.Event()
        for number, board in enumerate(boards):
            publisher = Publisher(board, network, f"load/{number}", batch_s=batch_s)
            threading.Thread(target=publisher.run, args=(stop,), daemon=True).start()
        bare = network.declare_publisher("bare/pair", express=True)
        pipe.send("ready")
        pipe.recv()
        begun_s, rng = time.monotonic() + 0.1, random.Random(1)
        rates = [RATE_HZ] * links
        if full:
            rates[-1] = FULL_HZ
        pipe.send(
            (
                begun_s,
                [board.go(begun_s + rng.random() / rate, rate) for board, rate in zip(boards, rates, strict=True)],
            )
        )
        used_s = time.process_time()
        _beat(bare, begun_s + seconds)
        pipe.send((time.process_time() - used_s,))
        time.sleep(LONG_S)


def _beat(bare: Any, until_s: float) -> None:
    """The bare pair: a message with its time, 1,000 times per second."""
    while (now_s := time.monotonic()) < until_s:
        bare.put(np.float64(now_s).tobytes() + bytes(BARE_BYTES - 8))
        time.sleep(1 / RATE_HZ)


def _read(pipe: Connection, endpoint: str, links: int, batch_s: float, full: bool, seconds: float) -> None:
    bare: list[float] = []
    with session.connected(endpoint) as network, ExitStack() as stack:
        network.declare_subscriber(
            "bare/pair",
            lambda sample: bare.append(time.monotonic() - np.frombuffer(sample.payload.to_bytes()[:8])[0]),
        )
        boards = []
        for number in range(links):
            port = f"zenoh://load/{number}?connect={endpoint}"
            boards.append(stack.enter_context(contactfpga.open(port, timeout=LONG_S)))
        pipe.send("ready")
        pipe.recv()
        begun_s, first = _answer(pipe)
        before = [_counted(board) for board in boards]
        used_s, found = time.process_time(), []
        with boards[0].subscribe(maxsize=1 << 16) as frames:
            while time.monotonic() < begun_s + seconds:
                number = source.number_of(frames.next(LONG_S).time_us) - first
                if number >= 0:
                    found.append(time.monotonic() - (begun_s + (number + 1) / RATE_HZ))
        used_s = time.process_time() - used_s
        counts = np.array([_counted(board) for board in boards]) - np.array(before)
        frames_count, lost, messages = counts.sum(axis=0).tolist()
        pipe.send((used_s, frames_count, lost, messages, _quantiles(found), _quantiles(bare)))
        time.sleep(LONG_S)


def _counted(board: contactfpga.Board) -> tuple[int, int, int]:
    stats = board.stats
    assert stats.net is not None
    return stats.frames, stats.lost + stats.unexplained + stats.net.lost_messages, stats.net.messages


def _quantiles(found: list[float]) -> tuple[float, float]:
    middle, most = np.quantile(found, [0.5, 0.99]).tolist()
    return middle, most
