"""Labellers of others on our bench."""

from contactfpga_sim.lab.registry import Section, Study

STUDY = Study(
    __package__,
    title="Labellers of others on our bench",
    page="rivals.md",
    minutes=60,
    sections={
        "rivals_made_of": Section("scripts/measure_rivals.py:provenance"),
        "rivals_exact": Section("scripts/measure_rivals.py:exactness_table"),
        "rivals": Section("scripts/measure_rivals.py:sizes_table"),
        "labellers": Section("scripts/measure_rivals.py:summary_table", page="performance.md"),
    },
    compute="scripts/measure_rivals.py:compute",
    extra="boards",
    needs=("git", "ghdl"),
)
