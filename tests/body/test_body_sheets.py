"""Sheets at one FPGA as links of a body, and over the network."""

import pytest
from net_processes import free_endpoint, patient, publish, wait_long

import contactfpga
from contactfpga.robot.body import Body

SHEETS = contactfpga.examples() / "two-sheets.toml"
LINK = """
[[links]]
name = "{name}"
frame = "{name}"
skin = "{folder}/two-sheets-{name}.toml"
port = "sim://?scene=palm&sheets={folder}/two-sheets.toml#{number}"
late_s = 60.0
silent_s = 90.0
"""
PORT = f"sim://?scene=palm&sheets={SHEETS}#{{}}"


@pytest.mark.slow
def test_two_links_share_a_port(tmp_path):
    links = [
        LINK.format(name=name, number=number, folder=SHEETS.parent) for number, name in enumerate(("chest", "back"))
    ]
    (tmp_path / "robot.toml").write_text("".join(links))
    with Body.load(tmp_path / "robot.toml").open() as body:
        snapshot = body.read(timeout=60.0)
    found = {name: (link.status, len(link.zones)) for name, link in snapshot.links.items()}
    assert found == {"chest": ("ok", 1), "back": ("ok", 1)}


@pytest.mark.slow
def test_one_publisher_has_both_sheets(monkeypatch):
    pytest.importorskip("zenoh")
    wait_long(monkeypatch)
    endpoint = free_endpoint()
    with publish(PORT.format(0), "--listen", endpoint, others=[PORT.format(1)]) as publisher:
        lines = [publisher.line, publisher.process.stdout.readline().strip()]
        assert lines == [f"zenoh://contactfpga/{name}?connect={endpoint}" for name in ("chest", "back")]
        for line, rows in zip(lines, (16, 12), strict=True):
            with contactfpga.open(patient(line), timeout=60) as board:
                assert (board.sheet.rows, len(board.read(timeout=60))) == (rows, 1)
