"""Workers for pieces of a chart, fit or sweep, and their progress."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, ProcessPoolExecutor

from contactfpga import terminal
from contactfpga.tools.console.interrupt import silence_amaranth

GRACE_S = 0.5
"""Time for a worker to clean up before it is killed."""

usual_jobs: int | None = None
"""Default processes; None: one per core."""

LINE_S = 5.0


@contextlib.contextmanager
def executor(jobs: int | None = None, dask: str | None = None) -> Iterator[Executor]:
    """An executor of ``jobs`` processes, :data:`usual_jobs` for None, or of the Dask cluster with this scheduler. If
    the block ends by an error or Ctrl-C, remaining work is dropped, and no process stays."""
    if dask is not None:
        with _cluster(dask) as workers:
            yield workers
        return
    with ProcessPoolExecutor(jobs or usual_jobs, initializer=alone) as workers:
        try:
            yield workers
        except BaseException:
            workers.shutdown(wait=False, cancel_futures=True)
            _end_children()
            raise


@contextlib.contextmanager
def _cluster(address: str) -> Iterator[Executor]:
    from distributed import Client

    with Client(address) as client:
        workers = client.get_executor()
        try:
            yield workers
        except BaseException:
            workers.shutdown(wait=False)
            raise


def alone() -> None:
    """Call first in a worker: it and its children become a group that ends as a whole, and with its parent."""
    os.setpgid(0, 0)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent's to decide
    signal.signal(signal.SIGTERM, _leave)
    threading.Thread(target=_outlive_nobody, daemon=True).start()


def _leave(*_: object) -> None:
    silence_amaranth()
    raise SystemExit


def _outlive_nobody() -> None:
    parent = multiprocessing.parent_process()
    assert parent is not None
    parent.join()
    os.killpg(0, signal.SIGKILL)


def _end_children() -> None:
    children = multiprocessing.active_children()
    _signal(children, signal.SIGTERM)
    until = time.monotonic() + GRACE_S
    while time.monotonic() < until and any(child.is_alive() for child in children):
        time.sleep(0.01)
    _signal(children, signal.SIGKILL)


def _signal(children: list[multiprocessing.process.BaseProcess], number: signal.Signals) -> None:
    for child in children:
        assert child.pid is not None
        with contextlib.suppress(ProcessLookupError):
            os.kill(child.pid, number)  # which may not have made its group yet
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(child.pid, number)


@contextlib.contextmanager
def progress() -> Iterator[Callable[[str, int], None]]:
    """Progress on standard error: each call, with a kind of work and its pieces, counts one."""
    with _bars() if terminal.of(sys.stderr).live else contextlib.nullcontext(_Lines()) as step:
        yield step


@contextlib.contextmanager
def _bars() -> Iterator[Callable[[str, int], None]]:
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TaskID, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}"), BarColumn(20), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=terminal.console(sys.stderr)) as shown:
        bars: dict[str, TaskID] = {}

        def step(name: str, of: int) -> None:
            if name not in bars:
                bars[name] = shown.add_task(name, total=of)
            shown.update(bars[name], advance=1, total=of)

        yield step


class _Lines:
    def __init__(self) -> None:
        self._done: dict[str, int] = {}
        self._began = self._said = time.monotonic()

    def __call__(self, name: str, of: int) -> None:
        self._done[name] = self._done.get(name, 0) + 1
        if time.monotonic() - self._said > LINE_S:
            self._said = time.monotonic()
            done = self._done[name]
            left_s = (self._said - self._began) * (of - done) / done
            print(f"{name}: {done} of {of}, about {left_s:.0f} s left", file=sys.stderr, flush=True)
