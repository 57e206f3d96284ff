"""Long tables of pages: a page keeps the rows that matter, a CSV file has all."""

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
"""Lines of a table above its rows."""
_PARTED = re.compile(rf"^(?:(?:\|.*\n)+\n)?All \[\d+ rows\]\(({FOLDER}/[\w-]+\.csv)\)\.", re.MULTILINE)


def part(text: str, kept: str, file: Path) -> str:
    """A section with only the rows of its longest table that match the regular expression ``kept``, and a link to the
    file with all. If no row matches, only the link stays."""
    table = max(_TABLE.findall(text), key=len).rstrip("\n")
    lines = table.splitlines()
    rows = lines[_HEAD:]
    shown = [row for row in rows if re.search(kept, row)]
    file.parent.mkdir(exist_ok=True)
    write_text(file, _csv(lines))
    link = f"All [{len(rows)} rows]({FOLDER}/{file.name})."
    return text.replace(table, "\n".join([*lines[:_HEAD], *shown, "", link] if shown else [link]), 1)


def whole(page: Path, name: str) -> str:
    """A section of a page with all rows, as its study made it."""
    text = writer.sections(page.read_text(encoding="utf-8"))[name].text
    return _PARTED.sub(lambda found: _table((page.parent / found[1]).read_text(encoding="utf-8")), text)


def _csv(lines: list[str]) -> str:
    text = io.StringIO()
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in (lines[0], *lines[_HEAD:])]
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue()


def _table(text: str) -> str:
    return writer.table_of(list(csv.reader(io.StringIO(text))))
