"""Sections of the pages as they stand there, and as their studies make them now."""

from pathlib import Path

from contactfpga_sim.lab import beside
from contactfpga_sim.lab.registry import StudyRun
from contactfpga_sim.lab.studies import STUDIES

DOCS = Path(__file__).resolve().parents[2] / "docs"


def section(page, name):
    """The text of a section of a page in ``docs``, with the rows that are in a file beside it."""
    return beside.whole(DOCS / page, name)


def outdated(study, *names, without=(), computed=None):
    """Sections of a study, of these names or all, that it would make otherwise now; ``computed``: what they share."""
    run = StudyRun(STUDIES[study])
    if computed is not None:
        run.computed = computed
    named = names or [name for name in run.study.sections if name not in without]
    return [name for name in named if run.text(name) != section(run.study.page_of(name), name)]
