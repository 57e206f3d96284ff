"""Speed against accuracy."""

from contactfpga_sim.lab.registry import Section, Study

STUDY = Study(
    __package__,
    title="Speed against accuracy",
    page="chart.md",
    minutes=30,
    sections={
        "front": Section("tables:front_table"),
        "host": Section("tables:host_table"),
    },
    compute="tables:compute",
    pictures="tables:draw",
    extra="chart",
)
