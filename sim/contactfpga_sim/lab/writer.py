"""Markdown tables, and sections of pages between ``<!-- figures: NAME of FINGERPRINT -->`` and ``<!-- end -->``; a
section that was never made has no fingerprint."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from contactfpga.inputs.files import write_text
from contactfpga.tools.console import outputs

Tables = Mapping[str, Callable[[], str]]

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
