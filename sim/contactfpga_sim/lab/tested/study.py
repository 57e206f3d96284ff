"""Changes of the gateware's source that the default tests notice."""

from contactfpga_sim.lab.registry import Section, Study

STUDY = Study(
    __package__,
    title="Changes of the gateware's source that the default tests notice",
    page="mutants.md",
    minutes=60,
    sections={
        "tested": Section("scripts/tested_mutants.py:table"),
        "left": Section("scripts/tested_mutants.py:left"),
    },
    compute="scripts/tested_mutants.py:compute",
    extra="test",
)
