"""Writes tables into pages: each stands between markers, ``<!-- figures: NAME -->`` and ``<!-- end -->``."""

from __future__ import annotations

import argparse
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path

from contactfpga.inputs.files import write_text
from contactfpga.tools.console import outputs

Tables = Mapping[str, Callable[[], str]]
"""What makes each table, by its name."""

_SECTION = re.compile(r"(<!-- figures: (\w+) -->).*?(<!-- end -->)", re.DOTALL)


def line(cells: Iterable[str]) -> str:
    """A line of a table."""
    return f"| {' | '.join(cells)} |"


def table(head: Sequence[str], lines: Iterable[str]) -> str:
    """A whole table; ``lines``: as :func:`line` makes them."""
    return "\n".join([line(head), "|---" * len(head) + "|", *lines])


def table_of(rows: Sequence[Sequence[str]]) -> str:
    """The same from cells; the first row is the head."""
    return table(rows[0], map(line, rows[1:]))


def update(text: str, tables: Tables) -> str:
    """The text of a page with those of its sections measured that are among ``tables``."""

    def measured(match: re.Match[str]) -> str:
        return f"{match[1]}\n{tables[match[2]]()}\n{match[3]}" if match[2] in tables else match[0]

    return _SECTION.sub(measured, text)


def write(path: Path, tables: Tables) -> None:
    """Write the tables into a page; each is there as soon as it is measured."""
    for name, measure in tables.items():
        before = path.read_text(encoding="utf-8")
        if f"<!-- figures: {name} -->" in before:
            write_text(path, update(before, {name: measure}))


def page(path: str | Path, option: str = "page") -> Path:
    """The page, which is there and can be written; looked at before anything is measured for it. Raises
    :class:`~contactfpga.tools.console.outputs.OutputError`."""
    if not Path(path).is_file():
        raise outputs.OutputError(f"{option} is {str(path)!r}; there is no such page")
    return outputs.file(path, option)


def page_and_folder(description: str) -> tuple[Path, Path]:
    """The page and the folder of its pictures that the command line names; ``description``: of the command. Both can be
    written. Raises :class:`~contactfpga.tools.console.outputs.OutputError`."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("page", type=Path, help="Page to write tables into.")
    parser.add_argument("folder", type=Path, help="Folder to draw pictures in.")
    args = parser.parse_args()
    return page(args.page), outputs.folder(args.folder, "folder")


def main(tables: Tables) -> int:
    """Update the pages named on the command line."""
    parser = argparse.ArgumentParser(description="Measure the tables in these pages and write them there.")
    parser.add_argument("pages", type=Path, nargs="+")
    for path in list(map(page, parser.parse_args().pages)):
        write(path, tables)
        print(f"measured {path}")
    return 0
