"""Mutants of the netlist that the comparison with the golden model tells."""

from contactfpga_sim.lab.registry import Section, Study

STUDY = Study(
    __package__,
    title="Mutants of the netlist that the comparison with the golden model tells",
    page="mutants.md",
    minutes=90,
    sections={
        "mutants": Section("tables:mutants_table"),
        "options": Section("tables:options_table"),
        "several": Section("tables:several_table"),
    },
    compute="tables:compute",
)
