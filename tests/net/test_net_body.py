"""A robot whose boards are on other machines: `zenoh://` ports in robot.toml."""

import json

import pytest
from fake_board import wait_until
from small_port import SmallPort, published

import contactfpga
from contactfpga.robot.body import Body, NoLinkData
from contactfpga.robot.net import session
from contactfpga.tools import cli

pytest.importorskip("zenoh")

SKIN = contactfpga.Skin()
LONG = 60.0
LINK = """
[[links]]
name = "{name}"
skin = "skin.toml"
port = "zenoh://robot/{name}?connect={endpoint}"
late_s = 60.0
silent_s = 90.0
"""


@pytest.fixture
def robot(tmp_path, endpoint, monkeypatch):
    # A busy machine lets who lives be silent, too; the test waits until such a link is back.
    monkeypatch.setattr("contactfpga.robot.net.port.GONE_S", 5.0)
    (tmp_path / "skin.toml").write_text(SKIN.to_toml())
    path = tmp_path / "robot.toml"
    path.write_text("".join(LINK.format(name=name, endpoint=endpoint) for name in ("left", "right")))
    return path


def board(skin=SKIN):
    source = SmallPort(skin)
    source.go(100.0)
    return source


def answered(opened, *names):
    """The first snapshot in which these links answer, and no other one: any may have to wait for the processor."""
    found = []
    wait_until(lambda: found.append(opened.read(LONG)) or found[-1].answering == names)
    return found[-1]


def test_links_on_another_machine_come_and_go_by_themselves(robot, endpoint, capsys):
    """And what one of them does is nothing to the others."""
    with session.listening(endpoint) as network, published(board(), network, "robot/right"):
        with published(board(), network, "robot/left"):
            assert cli.main(["body", str(robot), "--json", "--timeout", "60"]) == 0
            shown = json.loads(capsys.readouterr().out)
            assert [one["link"] for one in shown["contacts"]] == ["left", "right"]
            opened = Body.load(robot).open(timeout=LONG)
            answered(opened, "left", "right")
        with opened:
            wait_until(lambda: opened.latest().links["left"].status == "lost")
            snapshot = answered(opened, "right")
            with pytest.raises(NoLinkData, match=r"left.*(is gone: its publisher ended|nobody publishes it)"):
                snapshot.contacts("link")
            assert [one.link for one in snapshot.contacts("link", links=snapshot.answering)] == ["right"]
            with published(board(), network, "robot/left"):
                assert [one.link for one in answered(opened, "left", "right").contacts("link")] == ["left", "right"]
            with published(board(SKIN.replace(pitch_x_mm=20.0)), network, "robot/left"):
                wait_until(lambda: opened.latest().links["left"].status == "mismatch")
                assert "was built from" in opened.latest().links["left"].reason
            wait_until(lambda: opened.latest().links["right"].status == "ok")
