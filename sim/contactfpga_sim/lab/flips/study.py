"""Flipped bits of the running gateware."""

from contactfpga_sim.lab.registry import Section, Study

STUDY = Study(
    __package__,
    title="Flipped bits of the running gateware",
    page="flips.md",
    minutes=30,
    sections={
        "worst": Section("tables:worst_text"),
        "flipped": Section("tables:designs_table"),
        "modules": Section("tables:modules_table"),
        "ways": Section("tables:ways_table"),
    },
    compute="tables:compute",
    pictures="tables:draw",
    extra="chart",
)
