"""Random histories: boards are unplugged, plugged in again, muted, exchanged. What the body says is compared with what
the world did."""

from __future__ import annotations

import random

import pytest
from model_board import ModelBoard
from wire import Wire

import contactfpga
from contactfpga.robot.body import Body, NoLinkData
from contactfpga.robot.body.plan import read
from contactfpga.robot.body.reader import RETRY_S, WAIT_S, LinkReader
from contactfpga.robot.body.snapshot import Snapshot

SKIN, OTHER = contactfpga.Skin(), contactfpga.Skin(connectivity=4)
EVERY_S = 0.01
LINKS = ("arm", "chest", "leg")
SLACK_S = len(LINKS) * WAIT_S + 0.05
"""All links are read by one thread here, so each may have to wait for the others."""
OFF_S = SLACK_S + 0.01
"""By so much the first frames may seem younger than they are, as they waited to be read; then the clocks are known."""
SLOW = {"late_s": SLACK_S + 0.05, "silent_s": 3 * SLACK_S}
SETTLED_S = 2 * RETRY_S + 0.5 + 3 * SLACK_S
"""After the last event: a try to open, a hello, and as long again."""


class World:
    """One clock for all, and what was sent when."""

    def __init__(self):
        self.now = 100.0
        self.sent = {}  # number of a frame: (link, Skin, when)
        self.devices = {}

    def opened(self, plan):
        device = self.devices.get(plan.port)
        if device is None:
            raise contactfpga.PortNotFound(f"{plan.port} cannot be opened: it is not there")
        return contactfpga.open(Port(self, plan.port, device), plan.skin, timeout=0.2)


class Device(ModelBoard):
    """A board that sends a numbered frame every 10 ms of the world's time, and hello twice per second."""

    def __init__(self, world, port, skin):
        super().__init__(skin)
        self.world, self.port = world, port
        self.mute = False
        self.out = b""
        self.next_s = self.hello_s = self.born_s = world.now

    def run(self):
        while self.next_s <= self.world.now:
            if not self.mute:
                number = len(self.world.sent)
                self.world.sent[number] = (self.port, self.wire.skin, self.next_s)
                self.time_us = round(1e6 * (self.next_s - self.born_s))
                self.moments = [(64, number % 960, number // 960)]
                self.out += self.frame()
                if self.next_s >= self.hello_s:
                    self.out += self.hello()
                    self.hello_s += 0.5
            self.next_s += EVERY_S


class Port:
    """A serial port's end, until the device at the other one is unplugged."""

    def __init__(self, world, name, device):
        self.world, self.name, self.device = world, name, device
        device.out = b""  # what nobody listened to

    def _check(self):
        if self.world.devices.get(self.name) is not self.device:
            raise contactfpga.PortLost(f"{self.name} is gone")

    def write(self, data):
        self._check()
        for _, hello in self.device.hear(data):
            self.device.out += self.device.hello() if hello and not self.device.mute else b""

    def read(self, seconds):
        self._check()
        self.device.run()
        if not self.device.out:
            self.world.now += seconds
            self.device.run()
        data, self.device.out = self.device.out, b""
        return data

    def clock(self):
        return self.world.now

    def close(self):
        pass


@pytest.fixture
def body(tmp_path):
    (tmp_path / "skin.toml").write_text(SKIN.to_toml())
    plans = [read({"name": name, "skin": "skin.toml", "port": name} | SLOW, tmp_path) for name in LINKS]
    return Body({plan.name: plan for plan in plans})


class History:
    def __init__(self, body, seed):
        self.random = random.Random(seed)
        self.world = World()
        self.readers = {
            name: LinkReader(plan, self.world.opened, lambda: self.world.now) for name, plan in body.links.items()
        }
        self.body = body
        self.event_s = dict.fromkeys(LINKS, self.world.now)
        self.mute_s = {}
        self.seen = set()

    def step(self):
        if self.random.random() < 0.04:
            self.event(self.random.choice(LINKS))
        for reader in self.random.sample(list(self.readers.values()), len(LINKS)):
            reader.step()
        self.world.now += self.random.choice([0.0, 0.001, 0.02])
        for device in self.world.devices.values():
            device.run()
        self.check()

    def event(self, name):
        devices = self.world.devices
        self.event_s[name] = self.world.now
        match self.random.choice(["plug", "plug", "other", "unplug", "mute", "restart", "flash", "leap"]):
            case "leap":  # the computer was suspended, or had other things to do; frames wait at the ports
                self.world.now += self.random.choice([0.05, 0.6, 3.0])
                self.event_s = dict.fromkeys(LINKS, self.world.now)
            case "plug":
                devices[name] = Device(self.world, name, SKIN)
            case "other":
                devices[name] = Device(self.world, name, OTHER)
            case "unplug":
                devices.pop(name, None)
            case "mute" if name in devices:
                devices[name].mute = True
            case "flash" if name in devices:  # the port stays
                devices[name].wire = Wire(self.random.choice([SKIN, OTHER]))
                devices[name].power_up()
                devices[name].hello_s = devices[name].born_s = self.world.now
            case "restart" if name in devices:
                devices[name].power_up()
                devices[name].born_s = self.world.now
                devices[name].mute = False

    def check(self):
        now = self.world.now
        states = {name: reader.state() for name, reader in self.readers.items()}
        for name, state in states.items():
            self.seen.add(state.status)
            if state.zones is not None:
                ((area, sum_x, sum_y),) = state.zones.records.tolist()
                port, skin, sent_s = self.world.sent[sum_x + 960 * sum_y]
                assert (area, port, skin) == (64, name, SKIN), "of this link's board, and none of another Skin"
                limit = {"ok": self.body.links[name].late_s, "late": self.body.links[name].silent_s}[state.status]
                assert now - sent_s <= limit + SLACK_S, "nothing old passes for new"
                assert abs(state.age_s - (now - sent_s)) < OFF_S, "on the clock of all"
            if now - self.event_s[name] > SETTLED_S + self.body.links[name].silent_s:
                assert state.status == self.expected(name), state
        missing = {name for name, state in states.items() if state.status != "ok"}
        snapshot = Snapshot(self.body, now, states)
        assert len(snapshot.contacts("link", links=snapshot.answering)) == len(LINKS) - len(missing)
        if missing:
            with pytest.raises(NoLinkData) as error:
                snapshot.contacts("link")
            assert set(error.value.links) == missing
        else:
            assert {contact.link for contact in snapshot.contacts("link")} == set(LINKS)

    def expected(self, name):
        device = self.world.devices.get(name)
        if device is None:
            return "lost"
        if device.mute:
            return "silent"
        return "ok" if device.wire.skin is SKIN else "mismatch"


@pytest.mark.parametrize("seed", [4, 5, 7])
def test_states_and_frames_are_those_of_the_world(body, seed):
    history = History(body, seed)
    for _ in range(600):
        history.step()
    assert history.seen == {"ok", "late", "silent", "lost", "mismatch"}
