"""Choices of `contactfpga fit` for the examples of docs/fit.md."""

from __future__ import annotations

import argparse
import shlex
import sys

from contactfpga.tools.commands.fit import add_flags, asked
from contactfpga.tools.console.flags import Flags
from contactfpga_sim.apps import pool
from contactfpga_sim.apps.fit import show
from contactfpga_sim.apps.fit.search import fit
from contactfpga_sim.lab import writer

SHOWN = 8
"""Number of sheets that the page shows."""


def section(arguments: str) -> writer.Table:
    """The page shows the last sheets, each by its last row: the nearest to the limits, or the answer."""
    command = f"contactfpga fit {arguments}"
    print(command, file=sys.stderr)
    parser = argparse.ArgumentParser()
    add_flags(Flags(parser))
    task, tried = asked(parser.parse_args(shlex.split(arguments)))
    with pool.executor(None, None) as executor, pool.progress() as step:
        found = fit(task, tried, executor, step)
    head, checked = show.reported(found)[:2]
    checked[0] = checked[0].partition(",")[0]
    names, *rows = show.rows(found)
    after = f"{writer.table_of([head, checked])}\n\n{' '.join(show.notes(found))}"
    columns = [name for name in names if name not in ("pitch mm", "bytes")]
    last = [*{row[names.index("sheet")]: row for row in rows}.values()][-SHOWN:]
    return writer.Table(names, rows, lambda row: row in last, columns, f"    {command}", after)


def fingers_section() -> writer.Table:
    return section("examples/scenes-fingers.toml")
