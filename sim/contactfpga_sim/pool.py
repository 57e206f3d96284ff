"""What works out the pieces of a chart, a fit or a sweep, and how far it is."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, ProcessPoolExecutor


def executor(jobs: int | None, dask: str | None) -> Executor:
    """So many processes on this machine, one a core where None is said; or the cluster with this scheduler."""
    if dask is None:
        return ProcessPoolExecutor(jobs)
    from distributed import Client

    return Client(dask).get_executor()


@contextlib.contextmanager
def progress() -> Iterator[Callable[[str, int], None]]:
    """Bars on standard error: each call, with a kind of work and how many pieces there are of it, counts a piece."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TaskID, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True)) as shown:
        bars: dict[str, TaskID] = {}

        def step(name: str, of: int) -> None:
            if name not in bars:
                bars[name] = shown.add_task(name, total=of)
            shown.update(bars[name], advance=1, total=of)

        yield step
