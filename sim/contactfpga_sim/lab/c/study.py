"""Memory and code of the C header on microcontrollers."""

from contactfpga_sim.lab.registry import Section, Study

STUDY = Study(
    __package__,
    title="Memory and code of the C header on microcontrollers",
    page="c.md",
    minutes=1,
    sections={
        "c": Section("tables:sizes_table"),
    },
    needs=("arm-none-eabi-gcc",),
)
