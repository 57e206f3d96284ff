"""The page on networks: its tables and its picture show the same runs."""

import collections
from pathlib import Path

import pytest

from contactfpga_sim.lab.net import load, tables
from contactfpga_sim.lab.registry import StudyRun
from contactfpga_sim.lab.studies import STUDIES

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(autouse=True)
def at_the_root(monkeypatch):
    monkeypatch.chdir(ROOT)


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


def test_the_picture_shows_the_pages_table(tmp_path):
    drawn = tables.draw(tmp_path)
    assert drawn.read_text(encoding="utf-8") == (ROOT / "docs/images/net.svg").read_text(encoding="utf-8")


def test_the_picture_has_the_figures_of_its_rows(tmp_path, monkeypatch):
    """Two links take 8 % each of a publisher's core, and half of the frames 6 ms, three times those of a bare pair."""
    whole = (
        "links,a,b,c,CPU,router,reader,latency,times\n"
        "1,1,1,0,9.0 %,1.0 %,2.0 %,5.0 / 9.0 ms,2.0 / 3.0\n"
        "2,1,1,0,8.0 %,1.0 %,2.0 %,6.0 / 9.0 ms,3.0 / 9.0\n"
        '"2, and one more",1,1,0,7.0 %,1.0 %,2.0 %,6.0 / 9.0 ms,3.0 / 9.0\n'
    )
    (tmp_path / "net-links.csv").write_text(whole)
    monkeypatch.setattr(tables, "WHOLE", tmp_path / "net-links.csv")
    seen = {}
    monkeypatch.setattr(tables.style, "save", lambda figure, path: seen.update(figure=figure))
    tables.draw(tmp_path)
    cpu, latency = seen["figure"].axes
    shown = {
        line.get_label(): (line.get_xdata().tolist(), line.get_ydata().tolist())
        for line in (*cpu.lines, *latency.lines)
    }
    assert shown["publisher"] == ([1, 2], [9, 8])
    assert shown["half arrive (p50)"] == ([1, 2], [5, 6])
    assert shown["p50 of a bare pair"] == ([1, 2], [2.5, 2])
    assert shown["p99 of a bare pair"] == ([1, 2], [3, 1])
