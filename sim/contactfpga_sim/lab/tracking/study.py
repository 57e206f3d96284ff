"""Contacts followed over scenes and recordings."""

from contactfpga_sim.lab.registry import Section, Study

STUDY = Study(
    __package__,
    title="Contacts followed over scenes and recordings",
    page="tracking.md",
    minutes=5,
    sections={
        "speed": Section("tables:speed_table"),
        "reflex": Section("tables:reflex_table"),
        "breaks": Section("tables:breaks_table"),
        "scores": Section("tables:scores_table", sample="tables:scores_sample"),
        "recorded": Section("tables:recorded_table", needs=("../shared/data",)),
    },
    pictures="tables:draw",
    extra="test",
)
