"""Markdown tables, and sections of pages between ``<!-- figures: NAME of FINGERPRINT -->`` and ``<!-- end -->``; a
section that was never made has no fingerprint."""

from __future__ import annotations

import csv
import dataclasses
import io
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from contactfpga.inputs.files import write_text
from contactfpga.tools.console import outputs

Tables = Mapping[str, Callable[[], str]]

FOLDER = "tables"
"""Folder of the CSV files within the pages."""
_PARTED = re.compile(rf"^(?:\|.*\n)+\nAll \[\d+ rows(?:, \d+ columns)?\]\(({FOLDER}/[\w-]+\.csv)\)\.", re.MULTILINE)
_SECTION = re.compile(r"<!-- figures: (\w+)(?: of (\w+))? -->\n(.*?)\n?<!-- end -->", re.DOTALL)


class PageSection(NamedTuple):
    text: str
    fingerprint: str


def sections(page: str) -> dict[str, PageSection]:
    return {name: PageSection(text, fingerprint) for name, fingerprint, text in _SECTION.findall(page)}


def line(cells: Iterable[str]) -> str:
    return f"| {' | '.join(cells)} |"


def table(head: Sequence[str], lines: Iterable[str]) -> str:
    """A table of lines by :func:`line`."""
    return "\n".join([line(head), "|---" * len(head) + "|", *lines])


def table_of(rows: Sequence[Sequence[str]]) -> str:
    """A table of cells; the first row is the head."""
    return table(rows[0], map(line, rows[1:]))


@dataclasses.dataclass(frozen=True)
class Table:
    """A section's table. The page shows some of its rows and columns, a CSV file beside the page has all."""

    head: Sequence[str]
    rows: Sequence[Sequence[str]]
    shown: Callable[[Sequence[str]], object] | None = None
    """Whether the page shows a row, by its cells; None: it shows all."""
    columns: Sequence[str] = ()
    """Headings of the columns that the page shows; empty: all."""
    before: str = ""
    after: str = ""
    """Text around the table."""

    def __str__(self) -> str:
        """The whole table, with the text around it."""
        return self._around(table_of([self.head, *self.rows]))

    def on_page(self, file: Path) -> str:
        """The text of the page; writes the file if the page shows less than all."""
        columns = [number for number, head in enumerate(self.head) if not self.columns or head in self.columns]
        rows = [row for row in self.rows if self.shown is None or self.shown(row)]
        if (len(rows), len(columns)) == (len(self.rows), len(self.head)):
            return spelled(str(self))
        file.parent.mkdir(exist_ok=True)
        write_text(file, spelled(_csv([self.head, *self.rows])))
        size = f"{len(self.rows)} rows" + (f", {len(self.head)} columns" if self.columns else "")
        picked = table_of([[row[number] for number in columns] for row in (self.head, *rows)])
        return spelled(self._around(f"{picked}\n\nAll [{size}]({FOLDER}/{file.name})."))

    def _around(self, text: str) -> str:
        return "\n\n".join(filter(None, (self.before, text, self.after)))


def _csv(rows: Iterable[Sequence[str]]) -> str:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue()


def whole(page: Path, name: str) -> str:
    """The text of a section, with all rows of its table."""
    text = sections(page.read_text(encoding="utf-8"))[name].text
    return _PARTED.sub(lambda found: read_table(page.parent / found[1]), text)


def read_table(file: Path) -> str:
    """The table of a CSV file in Markdown."""
    with file.open(newline="", encoding="utf-8") as text:
        return table_of(list(csv.reader(text)))


def spelled(text: str) -> str:
    """Terminal text as pages spell it: µs for us."""
    return re.sub(r"(?<!-)\bus\b", "µs", text)


def update(text: str, tables: Tables, fingerprint: str | None = None) -> str:
    """A page's text with sections among ``tables`` rewritten, with their fingerprint; None keeps it."""

    def made(match: re.Match[str]) -> str:
        name, before = match[1], match[2]
        if name not in tables:
            return match[0]
        mark = before if fingerprint is None else fingerprint
        head = f"{name} of {mark}" if mark else name
        return f"<!-- figures: {head} -->\n{tables[name]()}\n<!-- end -->"

    return _SECTION.sub(made, text)


def write(path: Path, tables: Tables, fingerprint: str | None = None) -> None:
    """:func:`update` a page, with each table as soon as it is made."""
    for name, measure in tables.items():
        before = path.read_text(encoding="utf-8")
        if name in sections(before):
            write_text(path, update(before, {name: measure}, fingerprint))


def page(path: str | Path, option: str = "page") -> Path:
    """The page, checked to be writable. Raises :class:`~contactfpga.tools.console.outputs.OutputError`."""
    if not Path(path).is_file():
        raise outputs.OutputError(f"{option} is {str(path)!r}; there is no such page")
    return outputs.file(path, option)
