"""Tables for any terminal width."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from rich import box
from rich.cells import cell_len
from rich.console import JustifyMethod
from rich.markup import escape
from rich.table import Table

from contactfpga import terminal

GAP = 3

FOLDED = 24
"""Least width of a column of sentences."""

HEADING = 8
"""Least width of a broken heading."""


def show(rows: Sequence[Sequence[str]], **options: Any) -> None:
    """Print :func:`tables` to the terminal's width, with a blank line after each."""
    console = terminal.console()
    for table in tables(rows, console.width, **options):
        console.print(table)
        console.print()


def tables(
    rows: Sequence[Sequence[str]],
    width: int,
    *,
    keys: int = 1,
    title: str = "",
    texts: Sequence[int] = (),
    styles: Mapping[int, str] | None = None,
) -> Iterator[Table]:
    """The head and lines of ``rows`` as few tables of this width, each with the first ``keys`` columns.

    ``texts``: left-aligned columns of words. The last column is wrapped if needed, and so is an only key. ``styles``:
    of lines by number.
    """
    columns = [list(column) for column in zip(*rows, strict=True)]
    last = len(columns) - 1
    widths = _widths(columns, last in texts)
    if _total(widths) > width:
        for column in columns:
            column[0] = _folded(column[0], max([HEADING, *map(cell_len, column[1:])]))
        widths = _widths(columns, last in texts)
    if keys == 1 and _total(widths) > width:
        widths[0] = min(widths[0], max(FOLDED, 2 * width // 5))
    while keys > 1 and _total([*widths[:keys], max(widths[keys:])]) > width:
        keys -= 1
    for number, group in enumerate(_groups(widths, keys, width)):
        made = Table(box=box.SIMPLE_HEAD, show_edge=False, pad_edge=False)
        made.title, made.title_justify, made.title_style = ("" if number else title) or None, "left", "bold"
        tight = _total([widths[one] for one in group]) > width
        for one in group:
            side: JustifyMethod = "left" if one < keys or one in texts else "right"
            folds = tight or (one == last and one in texts)
            fixed = None if folds else widths[one]
            made.add_column(escape(columns[one][0]), justify=side, width=fixed, overflow="fold")
        for line in range(1, len(rows)):
            made.add_row(*(escape(columns[one][line]) for one in group), style=(styles or {}).get(line - 1))
        yield made


def _widths(columns: Sequence[Sequence[str]], last_folds: bool) -> list[int]:
    widths = [max(cell_len(line) for cell in column for line in cell.split("\n")) for column in columns]
    return [*widths[:-1], min(widths[-1], FOLDED) if last_folds else widths[-1]]


def _folded(heading: str, width: int) -> str:
    longest = max(map(cell_len, heading.split()), default=1)
    return "\n".join(textwrap.wrap(heading, max(width, longest), break_on_hyphens=False)) or heading


def _groups(widths: Sequence[int], keys: int, width: int) -> Iterator[list[int]]:
    first = list(range(keys))
    group: list[int] = []
    for column in range(keys, len(widths)):
        if group and _total([widths[one] for one in [*first, *group, column]]) > width:
            yield first + group
            group = []
        group.append(column)
    yield first + group


def _total(widths: Sequence[int]) -> int:
    return sum(widths) + GAP * (len(widths) - 1)
