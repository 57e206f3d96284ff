"""Long tables: a page has the rows and columns that matter, a CSV file all."""

from __future__ import annotations

import csv
import io
import re
from pathlib import Path

from contactfpga.inputs.files import write_text
from contactfpga_sim.lab import writer

FOLDER = "tables"
"""Folder of the CSV files within the pages."""
_TABLE = re.compile(r"(?:^\|.*\|(?:\n|\Z))+", re.MULTILINE)
_HEAD = 2
_PARTED = re.compile(
    rf"^(?:(?:\|.*\n)+\n)?All \[\d+ rows(?:, \d+ columns)?\]\(({FOLDER}/[\w-]+\.csv)\)\.", re.MULTILINE
)


def part(text: str, kept: str, file: Path, heads: str = "") -> str:
    """A section with a link to the file, and of its longest table the rows that match the regular expression ``kept``,
    if any, with the headers that match ``heads``."""
    table = max(_TABLE.findall(text), key=len).rstrip("\n")
    lines = table.splitlines()
    rows = lines[_HEAD:]
    shown = [row for row in rows if re.search(kept, row)]
    columns = [number for number, head in enumerate(_cells(lines[0])) if re.search(heads, head)]
    file.parent.mkdir(exist_ok=True)
    write_text(file, _csv(lines))
    fewer = len(columns) < len(_cells(lines[0]))
    size = f"{len(rows)} rows, {len(_cells(lines[0]))} columns" if fewer else f"{len(rows)} rows"
    link = f"All [{size}]({FOLDER}/{file.name})."
    picked = [[_cells(row)[number] for number in columns] for row in (lines[0], *shown)]
    return text.replace(table, "\n".join([writer.table_of(picked), "", link] if shown else [link]), 1)


def whole(page: Path, name: str) -> str:
    text = writer.sections(page.read_text(encoding="utf-8"))[name].text
    return _PARTED.sub(lambda found: _table((page.parent / found[1]).read_text(encoding="utf-8")), text)


def _csv(lines: list[str]) -> str:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(map(_cells, (lines[0], *lines[_HEAD:])))
    return text.getvalue()


def _cells(line: str) -> list[str]:
    return [cell.strip() for cell in line.strip("|").split("|")]


def _table(text: str) -> str:
    return writer.table_of(list(csv.reader(io.StringIO(text))))
