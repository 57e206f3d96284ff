"""Skins that `contactfpga fit` chooses for the examples."""

from contactfpga_sim.lab.registry import Section, Study

STUDY = Study(
    __package__,
    title="Skins that `contactfpga fit` chooses for the examples",
    page="fit.md",
    minutes=5,
    sections={
        "bumper": Section("tables:bumper_section"),
        "hands": Section("tables:hands_section"),
        "sole": Section("tables:sole_section"),
    },
    extra="chart",
)
