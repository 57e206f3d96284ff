"""Sections of the pages as they stand there, and as their studies make them now."""

from pathlib import Path

from contactfpga_sim.lab import writer
from contactfpga_sim.lab.registry import StudyRun
from contactfpga_sim.lab.studies import STUDIES

DOCS = Path(__file__).resolve().parents[2] / "docs"


def section(page, name):
    """The text of a section of a page in ``docs``, with the rows that are in a file beside it."""
    return writer.whole(DOCS / page, name)


def cells(table):
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in table.splitlines()]


def outdated(study, computed, *names):
    """Sections of a study, of these names or all, that it would make otherwise of these results."""
    run = StudyRun(STUDIES[study])
    run.computed = computed
    return [name for name in names or run.study.sections if run.text(name) != section(run.study.page_of(name), name)]
