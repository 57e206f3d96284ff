"""Formulas for covers of foam against integrals and the paper."""

from contactfpga_sim.lab.registry import Section, Study

STUDY = Study(
    __package__,
    title="Formulas for covers of foam against integrals and the paper",
    page="cover.md",
    minutes=1,
    sections={
        "paper": Section("tables:paper_table", sample="tables:paper_table"),
        "rules": Section("tables:rules_table"),
        "failing": Section("tables:failing_table"),
        "sense": Section("tables:sense_table"),
        "thinning": Section("tables:thinning_table", sample="tables:thinning_table"),
        "foams": Section("tables:foam_table", sample="tables:foam_table"),
    },
    pictures="tables:draw",
    extra="test",
)
