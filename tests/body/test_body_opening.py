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
    """At each call of ``contactfpga.open``: the ports that are being opened, its own last."""
    (tmp_path / "skin.toml").write_text(FLAT.to_toml())
    ports = ["", "name:LEFT", "usb:1", "/dev/a", "/dev/b", "/dev/c"]
    links = [f'[[links]]\nname = "{number}"\nskin = "skin.toml"\n' for number in range(len(ports))]
    texts = [link + (f'port = "{port}"\n' if port else "") for link, port in zip(links, ports)]
    (tmp_path / "robot.toml").write_text("".join(texts))
    calls, inside, lock = [], [], threading.Lock()

    def fails(port, *_, **__):
        with lock:
            inside.append(port)
            calls.append(tuple(inside))
        time.sleep(0.05)
        with lock:
            inside.remove(port)
        raise PortNotFound("it is not there")

    monkeypatch.setattr(driver, "open", fails)
    with OpenBody(Body.load(tmp_path / "robot.toml")):
        # Ports that are named are opened together, so that one that does not answer delays no other one.
        wait_until(lambda: len(calls) >= 12 and any(len(ports) > 1 for ports in calls))
    return calls


def test_no_port_is_opened_while_boards_are_searched_for(opened):
    """It would be found taken, though nobody else has it."""
    searches = [ports for ports in opened if any(port is None or not port.startswith("/dev/") for port in ports)]
    assert len(searches) >= 3
    assert {len(ports) for ports in searches} == {1}
