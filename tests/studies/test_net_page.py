"""The picture of the page on networks shows the figures of its table."""

from pathlib import Path

from contactfpga_sim.lab.net import tables

ROOT = Path(__file__).resolve().parents[2]


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
