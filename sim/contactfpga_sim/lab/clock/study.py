"""Board time on the host's clock, over simulated ways to the host."""

from contactfpga_sim.lab.registry import Section, Study

STUDY = Study(
    __package__,
    title="Board time on the host's clock, over simulated ways to the host",
    page="clock.md",
    minutes=1,
    sections={
        "accuracy": Section("tables:accuracy_table", sample="tables:slow_sample"),
    },
)
