"""The page on networks: its tables and its picture show the same runs."""

import collections

from contactfpga_sim.lab.net import load, tables
from contactfpga_sim.lab.registry import StudyRun
from contactfpga_sim.lab.studies import STUDIES


def test_each_load_is_measured_once_for_all_tables_and_the_picture(monkeypatch, tmp_path):
    runs = collections.Counter()

    def measure(links, batch_s, full):
        runs[links, batch_s, full] += 1
        cpu = dict.fromkeys(("publishers", "router", "reader", "other reader"), 0.1)
        times = {"latency": (0.01, 0.02), "bare": (0.001, 0.002)}
        return load.NetworkRun(links=links, frames=1000.0, messages=100.0, share=1.0, lost=0, cpu=cpu, **times)

    monkeypatch.setattr(load, "measure", measure)
    tables.measured.cache_clear()
    try:
        run = StudyRun(STUDIES["net"])
        for name in run.study.sections:
            run.text(name)
        tables.draw(tmp_path)
    finally:
        tables.measured.cache_clear()
    assert set(runs.values()) == {1}
    assert len(runs) == len(tables.BATCHES_MS) + len(tables.LINKS)
