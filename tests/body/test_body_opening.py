"""Links whose boards have to be searched for beside links with a port: a search holds every port for a moment."""

import threading
import time

import pytest
from fake_board import wait_until
from two_links import FLAT

from contactfpga.driver import driver
from contactfpga.errors import PortNotFound
from contactfpga.robot.body import Body, OpenBody


@pytest.fixture
def opened(tmp_path, monkeypatch):
    """Which calls of ``contactfpga.open`` there were: (port, from, to)."""
    (tmp_path / "skin.toml").write_text(FLAT.to_toml())
    ports = ["", "name:LEFT", "usb:1", "/dev/a", "/dev/b", "/dev/c"]
    links = [f'[[links]]\nname = "{number}"\nskin = "skin.toml"\n' for number in range(len(ports))]
    texts = [link + (f'port = "{port}"\n' if port else "") for link, port in zip(links, ports)]
    (tmp_path / "robot.toml").write_text("".join(texts))
    calls, lock = [], threading.Lock()

    def fails(port, *_, **__):
        begun = time.monotonic()
        time.sleep(0.05)
        with lock:
            calls.append((port, begun, time.monotonic()))
        raise PortNotFound("it is not there")

    monkeypatch.setattr(driver, "open", fails)
    with OpenBody(Body.load(tmp_path / "robot.toml")):
        wait_until(lambda: len(calls) >= 12)
    return calls


def searched(call):
    return call[0] is None or not call[0].startswith("/dev/")


def apart(one, other):
    return one[2] <= other[1] or other[2] <= one[1]


def test_no_port_is_opened_while_boards_are_searched_for(opened):
    """It would be found taken, though nobody else has it."""
    searches = [call for call in opened if searched(call)]
    assert len(searches) >= 3
    for search in searches:
        assert all(call is search or apart(call, search) for call in opened)


def test_ports_that_are_named_are_opened_together(opened):
    """So that one that does not answer delays no other one."""
    named = [call for call in opened if not searched(call)]
    assert any(one is not other and not apart(one, other) for one in named for other in named)
