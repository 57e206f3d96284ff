"""Which board is on which link: identical ones, wrong ones, exchanged ones, and many."""

import time

import pytest
from fake_board import wait_until
from two_links import FLAT, Plugged, Streaming, state_of

import contactfpga
from contactfpga.driver.stats import Stats
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
    found = Plugged()
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


def test_a_board_that_is_flashed_with_another_name_is_a_mismatch(tmp_path):
    world = plugged(a=LEFT)
    with OpenBody(body_of(tmp_path, {"left": ("a", LEFT)}), opened=world.opened) as opened:
        assert opened.read(LONG).answering == ("left",)
        board = world.ports["a"]
        board.__init__(RIGHT)
        board._out = board.hello()
        wait_until(lambda: opened.latest().links["left"].status == "mismatch")


@pytest.mark.parametrize("skins", [(FLAT, LEFT), (LEFT, FLAT)], ids=["board", "Skin"])
def test_names_that_nobody_gave_are_none(tmp_path, skins):
    mine, theirs = skins
    with OpenBody(body_of(tmp_path, {"left": ("a", mine)}), opened=plugged(a=theirs).opened) as opened:
        assert opened.read(LONG).answering == ("left",)


def test_two_robots_of_the_same_skins_keep_to_their_own_boards(tmp_path):
    """Which differ in what touches them."""
    worlds, seen = [], []
    for number, moment in enumerate([(4, 8, 8), (4, 40, 40)]):
        world = plugged(a=FLAT, b=FLAT)
        for port in world.ports.values():
            port.moments = [moment]
        (tmp_path / str(number)).mkdir()
        body = body_of(tmp_path / str(number), {"left": ("a", FLAT), "right": ("b", FLAT)})
        worlds.append(OpenBody(body, opened=world.opened))
    try:
        for robot in worlds:
            contacts = robot.read(LONG).contacts("link")
            assert [one.link for one in contacts] == ["left", "right"]
            seen.append({one.zone.x_mm for one in contacts})
        assert seen == [{20.0}, {100.0}]
    finally:
        for robot in worlds:
            robot.close()


class Instant:
    """An open board that has a frame every 0.2 s, without a driver: 64 of these are few for a busy machine."""

    name = ""

    def __init__(self, zones):
        self.zones, self.stats = zones, Stats()

    def latest(self, timeout=1.0):
        time.sleep(min(timeout, 0.2))
        self.stats.frames += 1
        return self.zones

    read = latest

    def clock(self):
        return self.zones.host_time_s

    def close(self):
        pass


def test_64_links_with_some_that_are_gone(tmp_path):
    names = [f"link{number}" for number in range(64)]
    body = body_of(tmp_path, {name: (name, FLAT) for name in names})
    zones, absent = state_of(FLAT, 3, 5, 10.0).zones, set(names[::9])

    def opened(plan):
        if plan.name in absent:
            raise contactfpga.PortNotFound("it is not there")
        return Instant(zones)

    with OpenBody(body, opened=opened) as robot:
        wait_until(lambda: len(robot.latest().answering) == 64 - len(absent))
        snapshot = robot.latest()
        assert {name for name, state in snapshot.links.items() if state.status == "lost"} == absent
        assert len(snapshot.contacts("link", links=snapshot.answering)) == 64 - len(absent)
        absent.clear()
        wait_until(lambda: robot.latest().answering == tuple(names))
        stats = robot.stats
        assert stats.frames == sum(one.frames for one in stats.links.values()) >= 64
