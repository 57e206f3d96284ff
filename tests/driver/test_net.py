"""The whole driver through random histories of board, bridge and host, against a model of what it may return."""

import contextlib
import random

import pytest
from hypothesis import HealthCheck, Phase, settings
from hypothesis import strategies as st
from hypothesis.stateful import (
    RuleBasedStateMachine,
    initialize,
    invariant,
    precondition,
    rule,
    run_state_machine_as_test,
)
from world import Witness, World

import contactfpga
import contactfpga.driver.requests
from contactfpga.driver.clock import Timeline
from contactfpga.driver.requests import Requests

SKINS = [
    contactfpga.Skin(),
    contactfpga.Skin(pitch_x_mm=20.0, guard=True),
    contactfpga.Skin(pitch_x_mm=5.0, rows=20, columns=12, settle_us=20.0),
]
NAMED = (contactfpga.ReadTimeout, contactfpga.SkinMismatch, contactfpga.PortLost)
SHARES = st.sampled_from([0.0, 0.05, 0.4])
TIMEOUTS = st.sampled_from([0.001, 0.005, 0.02, 0.1, 1.0])


class History(RuleBasedStateMachine):
    """What comes out is what was sent, in order, at its time; what `read` returns was scanned after the call."""

    def __init__(self):
        super().__init__()
        self.world = self.board = self.witness = None

    @initialize(
        seed=st.integers(0, 1 << 30),
        up_us=st.sampled_from([0, 500, 16_000]),
        down_us=st.sampled_from([0, 1000, 16_000]),
        up_s=st.sampled_from([0, 16.6]),
    )
    def plug_in(self, seed, up_us, down_us, up_s):
        self.world = World(SKINS[0], scan_us=4000, up_us=up_us, down_us=down_us, seed=seed)
        rng = random.Random(seed)
        self.patch = pytest.MonkeyPatch()
        self.patch.setattr(contactfpga.driver.requests.random, "SystemRandom", lambda: rng)
        self.world.skip(round(up_s * 1e6))
        self.open()

    def open(self):
        self.world.closed = False
        self.witness = Witness(self.world)
        since = self.world.now_us
        with contextlib.suppress(contactfpga.ReadTimeout):
            self.board = contactfpga.open(self.world, timeout=3.0)
            self.witness.check(self.board.next(), since)

    @precondition(lambda self: self.board is None)
    @rule()
    def open_again(self):
        self.world.unplugged = False
        self.open()

    @precondition(lambda self: self.board)
    @rule(timeout=TIMEOUTS, calls=st.integers(1, 12))
    def read(self, timeout, calls):
        for _ in range(calls):
            since = self.world.now_us
            with contextlib.suppress(*NAMED):
                self.witness.check(self.board.read(timeout), since)

    @precondition(lambda self: self.board)
    @rule()
    def read_on_a_good_line(self):
        """Then an answer has to come."""
        self.world.lose = self.world.corrupt = self.world.lose_requests = 0.0
        since = self.world.now_us
        self.witness.check(self.board.read(3.0), since)

    @precondition(lambda self: self.board)
    @rule(timeout=TIMEOUTS, calls=st.integers(1, 400))
    def next(self, timeout, calls):
        for _ in range(calls):
            with contextlib.suppress(*NAMED):
                self.witness.check(self.board.next(timeout))

    @precondition(lambda self: self.board)
    @rule(word=st.sampled_from([0, 1, 8, 9]), good=st.booleans(), calls=st.integers(1, 30))
    def lines_break(self, word, good, calls):
        """Or are mended. On a good line a second later at most it is known."""
        if good:
            self.world.lose = self.world.corrupt = self.world.lose_requests = 0.0
        self.world.break_lines(word)
        for _ in range(calls):
            with contextlib.suppress(*NAMED):
                self.witness.check(self.board.next(0.01))
        if good and self.world.skin.guard:
            self.read_on_a_good_line()
            self.world.pause(1_200_000)
            self.read_on_a_good_line()
            self.witness.check_reported(self.board.faults)

    @precondition(lambda self: self.board)
    @rule()
    def latest(self):
        with contextlib.suppress(*NAMED):
            self.witness.check(self.board.latest(0.1))

    @precondition(lambda self: self.board)
    @rule(lose=SHARES, corrupt=SHARES, lose_requests=SHARES)
    def worsen(self, **shares):
        for name, share in shares.items():
            setattr(self.world, name, share)

    @precondition(lambda self: self.board)
    @rule(us=st.sampled_from([1000, 20_000, 300_000]))
    def work(self, us):
        self.world.pause(us)

    @precondition(lambda self: self.board)
    @rule(seconds=st.sampled_from([8, 16, 16.7, 40]))
    def pull_the_cable_for_a_while(self, seconds):
        self.world.skip(round(seconds * 1e6))

    @precondition(lambda self: self.board)
    @rule(torn=st.booleans(), mute=st.booleans())
    def restart(self, torn, mute):
        self.world.restart(torn=torn, mute=mute)

    @precondition(lambda self: self.board)
    @rule(skin=st.sampled_from(SKINS), torn=st.booleans(), mute=st.booleans())
    def load_another_bitstream(self, skin, torn, mute):
        self.world.restart(skin, torn=torn, mute=mute)

    @precondition(lambda self: self.board)
    @rule()
    def unplug(self):
        self.world.unplugged = True
        with contextlib.suppress(contactfpga.PortLost):
            while True:  # what has come is still there
                with contextlib.suppress(contactfpga.SkinMismatch):
                    self.witness.check(self.board.next())
        self.leave()

    @precondition(lambda self: self.board)
    @rule()
    def leave(self):
        self.board.close()
        with pytest.raises(contactfpga.BoardClosed):
            self.board.next()
        self.board = None

    @invariant()
    def no_more_frames_than_were_sent(self):
        if self.board is None:
            return
        stats = self.board.stats
        assert stats.frames + stats.unexplained + stats.before_hello <= len(self.world.truth) + sum(
            stats.damaged.values()
        )

    def teardown(self):
        if self.board is not None:
            self.board.close()
        self.patch.undo()


BUDGET = settings(
    max_examples=30,
    stateful_step_count=20,
    phases=[Phase.generate],
    deadline=None,
    derandomize=True,
    suppress_health_check=list(HealthCheck),
    database=None,
)


def test_random_histories():
    run_state_machine_as_test(History, settings=BUDGET)


# ---- the defects that there once were


def asked_by_a_flag(monkeypatch):
    """3: an answer is an answer, whichever request it is for."""

    def take_frame(self, heard, now):
        if heard:
            self.answered = self._tickets

    monkeypatch.setattr(Requests, "take_frame", take_frame)


def no_bits_of_the_fingerprint(monkeypatch):
    """5: frames of another bitstream pass their check and are not distrusted: they are read with the pitch of the one
    before."""
    times_without_doubt(monkeypatch)
    import wire

    import contactfpga.wire.framing

    bare = contactfpga.wire.framing.check_bytes
    monkeypatch.setattr(contactfpga.wire.framing, "check_bytes", lambda stuffed, before=b"": bare(stuffed))
    sealed = wire.seal
    monkeypatch.setattr(wire, "seal", lambda plain, before=b"": sealed(plain))


def times_without_doubt(monkeypatch):
    """After any pause the time goes on by the bits that the frame carries."""

    def explain(self, heard, time_us, sequence, now):
        if not self._known:
            return None
        if self._time_us is None:
            first_us = (self._epoch - 1) * (1 << 22)
            return first_us + (time_us - first_us) % (1 << 24)
        return self._time_us + (time_us - self._time_us) % (1 << 24)

    monkeypatch.setattr(Timeline, "_explain", explain)


DEFECTS = asked_by_a_flag, no_bits_of_the_fingerprint, times_without_doubt


@pytest.mark.parametrize("defect", DEFECTS)
def test_a_defect_that_is_put_back_is_found(monkeypatch, defect):
    defect(monkeypatch)
    with pytest.raises(AssertionError, match=r"never sent|asked for|no frame within|never reported"):
        run_state_machine_as_test(History, settings=settings(BUDGET, max_examples=5000))
