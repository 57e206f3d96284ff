"""The page on networks: its tables and its picture show the same runs."""

import collections

from contactfpga_sim.lab.net import load
from contactfpga_sim.lab.pages import net_page


def test_each_load_is_measured_once_for_all_tables_and_the_picture(monkeypatch, tmp_path):
    runs = collections.Counter()

    def measure(links, batch_s, full):
        runs[links, batch_s, full] += 1
        cpu = dict.fromkeys(("publishers", "router", "reader", "other reader"), 0.1)
        times = {"latency": (0.01, 0.02), "bare": (0.001, 0.002)}
        return load.Load(links=links, frames=1000.0, messages=100.0, share=1.0, lost=0, cpu=cpu, **times)

    monkeypatch.setattr(load, "measure", measure)
    net_page.measured.cache_clear()
    try:
        for table in net_page.TABLES.values():
            table()
        net_page.draw(tmp_path)
    finally:
        net_page.measured.cache_clear()
    assert set(runs.values()) == {1}
    assert len(runs) == len(net_page.BATCHES_MS) + len(net_page.LINKS)
