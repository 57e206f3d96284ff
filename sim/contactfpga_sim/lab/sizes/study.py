"""Size and clock by place and route."""

from contactfpga_sim.lab.registry import Section, Study

STUDY = Study(
    __package__,
    title="Size and clock by place and route",
    page="performance.md",
    minutes=60,
    sections={
        "gateware": Section("tables:gateware_table", of_netlists=True),
        "faults": Section("tables:faults_table", of_netlists=True),
        "units_size": Section("tables:units_table", page="units.md", of_netlists=True),
        "boards": Section("tables:boards_table", page="boards.md"),
    },
    extra="boards",
)
