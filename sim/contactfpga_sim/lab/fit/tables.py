"""Choices of `contactfpga fit` for the examples of docs/fit.md."""

from __future__ import annotations

import argparse
import shlex
import sys

from contactfpga.tools.commands.fit import add_flags, asked
from contactfpga.tools.console.flags import Flags
from contactfpga_sim.lab import pool, writer
from contactfpga_sim.lab.fit import show
from contactfpga_sim.lab.fit.search import fit


def section(arguments: str) -> str:
    """Settings that Skin refuses are left out."""
    command = f"contactfpga fit {arguments}"
    print(command, file=sys.stderr)
    parser = argparse.ArgumentParser()
    add_flags(Flags(parser))
    task, tried = asked(parser.parse_args(shlex.split(arguments)))
    with pool.executor(None, None) as executor, pool.progress() as step:
        found = fit(task, tried, executor, step)
    head, checked = show.reported(found)[:2]
    checked[0] = checked[0].partition(":")[0]
    tables = (show.rows(found, impossible=False), [head, checked])
    none = f"Skin itself refuses {len(found.impossible)} more settings."
    return "\n\n".join((f"    {command}", *map(writer.table_of, tables), " ".join((*show.notes(found), none))))


def fingers_section() -> str:
    return section("examples/scenes-fingers.toml")
