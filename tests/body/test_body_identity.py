"""Which board is on which link: identical ones, wrong ones, exchanged ones, and many."""

import pytest
from fake_board import wait_until
from two_links import FLAT, PluggedPorts, Streaming

import contactfpga
from contactfpga.robot.body import Body, OpenBody
from contactfpga.robot.body.plan import read

LEFT, RIGHT = FLAT.replace(name="LEFT"), FLAT.replace(name="RIGHT")
PATIENT = {"late_s": 60.0, "silent_s": 90.0}
LONG = 60.0


def body_of(folder, links):
    """By name, port and Skin."""
    plans = {}
    for name, (port, skin) in links.items():
        (folder / f"{name}.toml").write_text(skin.to_toml())
        plans[name] = read({"name": name, "skin": f"{name}.toml", "port": port} | PATIENT, folder)
    return Body(plans)


def plugged(**boards):
    found = PluggedPorts()
    found.ports = {port: Streaming(skin) for port, skin in boards.items()}
    return found


def test_boards_that_changed_places_are_a_mismatch(tmp_path):
    """Boards of one Skin that were unplugged and came back at each other's port."""
    body = body_of(tmp_path, {"left": ("a", LEFT), "right": ("b", RIGHT)})
    world = plugged(a=LEFT, b=RIGHT)
    with OpenBody(body, opened=world.opened) as opened:
        assert opened.read(LONG).answering == ("left", "right")
        for port, skin in (("a", RIGHT), ("b", LEFT)):
            gone, world.ports[port] = world.ports[port], Streaming(skin)
            gone.read = lambda seconds: (_ for _ in ()).throw(contactfpga.PortLost("unplugged"))
        wait_until(lambda: {one.status for one in opened.latest().links.values()} == {"mismatch"})
        states = opened.latest().links
        assert states["left"].zones is None
        assert states["left"].reason == "the board is named 'RIGHT'; this link's Skin is named 'LEFT'"
        world.ports |= {"a": Streaming(LEFT), "b": Streaming(RIGHT)}
        wait_until(lambda: opened.latest().answering == ("left", "right"))


@pytest.mark.parametrize("skins", [(FLAT, LEFT), (LEFT, FLAT)], ids=["board", "Skin"])
def test_names_that_nobody_gave_are_none(tmp_path, skins):
    mine, theirs = skins
    with OpenBody(body_of(tmp_path, {"left": ("a", mine)}), opened=plugged(a=theirs).opened) as opened:
        assert opened.read(LONG).answering == ("left",)
