"""Who works out a chart's points, and the bar that shows how far they are."""

from __future__ import annotations

import argparse
import contextlib
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, ProcessPoolExecutor


def executor(args: argparse.Namespace) -> Executor:
    """The processes, or the Dask cluster, that ``args.jobs`` and ``args.dask`` ask for."""
    if args.dask is None:
        return ProcessPoolExecutor(args.jobs)
    from distributed import Client

    return Client(args.dask).get_executor()


@contextlib.contextmanager
def progress(first: str) -> Iterator[Callable[[str, int], None]]:
    """A bar; what it gives is called with the name and number of all steps after each of them."""
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns) as shown:
        bar = shown.add_task(first)

        def step(name: str, of: int) -> None:
            shown.update(bar, advance=1, total=of, description=name)

        yield step
