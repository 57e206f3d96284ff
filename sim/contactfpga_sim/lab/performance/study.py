"""Latency, rate and clocks of the gateware."""

from contactfpga_sim.lab.registry import Section, Study

STUDY = Study(
    __package__,
    title="Latency, rate and clocks of the gateware",
    page="performance.md",
    minutes=5,
    sections={
        "reference": Section("scans:reference_table", sample="scans:reference_sample"),
        "labeller": Section("labellers:labeller_table", sample="labellers:labeller_sample"),
        "report": Section("scans:report_table", sample="scans:report_sample"),
        "fast": Section("reversal:latency_table", sample="reversal:latency_sample"),
        "sides": Section("reversal:sides_table", sample="reversal:sides_sample"),
        "gain": Section("scans:scenes_gain_table", sample="scans:scenes_gain_table"),
        "recorded": Section("scans:recorded_gain_table", needs=("../shared/data",)),
        "labeller_recorded": Section("labellers:recordings_table", needs=("../shared/data",)),
    },
)
