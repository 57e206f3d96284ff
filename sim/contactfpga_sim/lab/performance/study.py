"""Latency, rate and clocks of the gateware."""

from contactfpga_sim.lab.registry import Section, Study

STUDY = Study(
    __package__,
    title="Latency, rate and clocks of the gateware",
    page="performance.md",
    minutes=5,
    sections={
        "reference": Section("scans:reference_table"),
        "labeller": Section("labellers:labeller_table"),
        "report": Section("scans:report_table"),
        "fast": Section("reversal:latency_table"),
        "sides": Section("reversal:sides_table"),
        "gain": Section("scans:scenes_gain_table"),
        "recorded": Section("scans:recorded_gain_table", needs=("../shared/data",)),
        "labeller_recorded": Section("labellers:recordings_table", needs=("../shared/data",)),
    },
)
