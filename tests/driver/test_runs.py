"""Frames decoded in runs are those decoded one by one, with the same counters, whatever happened to the bytes."""

import dataclasses
import itertools
import random
import threading

import numpy as np
import pytest
from byte_histories import SKINS, History, random_frame
from model_board import ModelBoard
from sample import sample

import contactfpga
from contactfpga.driver import conversation
from contactfpga.driver.conversation import Conversation, frames_in
from contactfpga.driver.framequeue import FrameQueue
from contactfpga.wire import table
from contactfpga.zones.batch import Batch
from contactfpga.zones.run import Run
from contactfpga.zones.zone import Zones

LONG = 8


def said(events):
    """The contents of events, frame by frame."""
    for event in events:
        if isinstance(event, Run):
            yield from map(described, event)
        else:
            yield repr(event)


def described(zones):
    frame = zones.frame
    arrays = tuple(
        None if one is None else (one.dtype, one.tolist()) for one in (frame.moments, frame.bitmap, frame.barycenters)
    )
    values = zones.to_dict()
    if values["host_time_s"] is not None:  # of a run the fit of clocks looks at the last frame alone
        assert values["host_time_s"] <= values["arrived_s"]
    del values["host_time_s"], values["host_sigma_s"]
    return repr((dataclasses.replace(frame, moments=None, bitmap=None, barycenters=None), arrays, values))


@pytest.mark.parametrize(
    ("name", "live"),
    sample(
        itertools.product(SKINS, (True, False)),
        quick=[(name, number % 2 == 0) for number, name in enumerate(SKINS)],
    ),
)
def test_runs_hold_the_frames_that_are_found_one_by_one(name, live, rng, monkeypatch):
    """One side decodes in Python and takes each frame alone; the other decodes runs in C if there is a library."""
    in_runs, answered = 0, set()
    for turn in range(2):
        known = 0
        history, stream, now = History(SKINS[name], rng), b"", 0.0
        one_by_one, in_many = (Conversation("x", None, live, random.Random(turn)) for _ in range(2))
        one_by_one.decode = table.decode
        for _ in range(25):
            if rng.random() < 0.5:
                assert one_by_one.ask(now, now + 1.0) == in_many.ask(now, now + 1.0)
            asked = one_by_one.data_to_send()
            assert asked == in_many.data_to_send()
            stream += history.more(rng.choice([1, 20, 60]), asked)
            cut = rng.choice([1, len(stream) // 2, len(stream), len(stream)])
            data, stream = stream[:cut], stream[cut:]
            mixed = in_many.receive(data, now)
            with monkeypatch.context() as alone_only:
                alone_only.setattr(conversation, "run_ends", ends_of_single_frames)
                alone = one_by_one.receive(data, now)
            assert list(said(mixed)) == list(said(alone))
            assert one_by_one.stats == in_many.stats
            assert one_by_one.unused == in_many.unused
            assert state(one_by_one, name) == state(in_many, name)
            in_runs += sum(len(event) for event in mixed if isinstance(event, Run) and len(event) >= LONG)
            known = check_answers(alone, mixed, known)
            answered.add((turn, known))
            now += rng.choice([0.001, 0.1, 0.1, 9.0])
    assert in_runs > 60
    assert len(answered) > 5


def ends_of_single_frames(packets):
    return [index + int(valid) for index, valid in enumerate(packets["valid"])]


def state(host, name):
    """State of the times of a conversation."""
    state = {**vars(host._timeline)}
    state["before"] = state["before"] and described(Zones(state["before"], SKINS[name].sheet))
    del state["_stats"]
    return state


def check_answers(alone, mixed, known):
    """Check that each run answers what its frames alone do, and that a run of several frames answers nothing new.
    Returns the last answer."""
    answers = [run.answers for run in alone if isinstance(run, Run)]
    for run in mixed:
        if isinstance(run, Run):
            assert {run.answers} == set(answers[: len(run)])
            assert len(run) == 1 or run.answers == known
            known, answers = run.answers, answers[len(run) :]
    assert not answers
    return known


@pytest.mark.parametrize("name", SKINS)
def test_a_batch_holds_what_its_frames_hold(name, rng):
    """A batch equals its frames, whether they came in runs or one by one."""
    board = ModelBoard(SKINS[name])
    stream = board.hello() + b"".join(random_frame(board, rng) for _ in range(400))
    runs = [event for event in Conversation("x").receive(stream, 1.5) if isinstance(event, Run)]
    assert max(map(len, runs)) >= LONG
    batch = Batch.of([run[0] if len(run) == 1 else run for run in runs])
    frames = frames_in(runs)
    for name in ("sequence", "time_us", "host_time_s", "total_zones", "pressed"):
        assert batch.frames[name].tolist() == [getattr(zones, name) for zones in frames], name
    assert np.diff(batch.starts).tolist() == [len(zones) for zones in frames]
    assert batch.zones["frame"].tolist() == [index for index, zones in enumerate(frames) for _ in zones]
    assert batch.zones["time_us"].tolist() == [zones.time_us for zones in frames for _ in zones]
    arrays = np.concatenate([zones.array for zones in frames])
    for name in arrays.dtype.names:
        np.testing.assert_array_equal(batch.zones[name], arrays[name], name)


# ---- the queue


def runs_and_errors(rng, count):
    """Events that a queue may get: runs of frames, and errors."""
    board = ModelBoard(SKINS["moments"])
    host = Conversation("x")
    host.receive(board.hello(), 0.0)
    for _ in range(count):
        stream = b"".join(board.frame() for _ in range(rng.choice([1, 3, 60])))
        yield from host.receive(stream, 0.0)
        if rng.random() < 0.1:
            yield contactfpga.SkinMismatch("another bitstream")


def times(items):
    return [item if isinstance(item, Exception) else item.time_us for item in items]


@pytest.mark.parametrize("maxsize", [1, 7, 10_000])
def test_a_frame_that_was_shown_comes_no_more_nor_do_those_before_it(maxsize, rng):
    """A frame that a program got as the newest is not delivered again, nor are earlier ones, waiting or still to
    come."""
    queue, plain, came, seen = FrameQueue(maxsize, came=5), [], 5, 5
    for item in runs_and_errors(rng, 300):
        if isinstance(item, Exception):
            continue
        queue.put(item)
        plain += [(came + index, zones) for index, zones in enumerate(item, 1)]
        came += len(item)
        plain = [one for one in plain if one[0] > seen][-maxsize:]
        seen = came - len(plain) if seen < came else seen
        match rng.randrange(5):
            case 0:
                number = rng.randint(max(1, seen - 3), came + 30)
                assert queue.show(number) == (number > seen)
                seen = max(seen, number)
                plain = [one for one in plain if one[0] > seen]
            case 1 if plain:
                seen, zones = plain.pop(0)
                assert queue.pop().time_us == zones.time_us
            case 2:
                found = frames_in(queue.pop_frames())
                assert times(found) == times([zones for _, zones in plain])
                seen, plain = max(seen, came), []
        assert (len(queue), queue.seen) == (len(plain), seen)
    assert times(iter(queue.pop, None)) == times([zones for _, zones in plain])


@pytest.mark.parametrize("maxsize", [1, 7, 100, 10_000])
def test_a_queue_of_runs_is_a_queue_of_frames(maxsize, rng):
    queue, plain, dropped = FrameQueue(maxsize), [], 0
    for item in runs_and_errors(rng, 300):
        queue.put(item)
        plain += item if isinstance(item, Run) else [item]
        gone, plain = plain[: max(0, len(plain) - maxsize)], plain[max(0, len(plain) - maxsize) :]
        dropped += sum(isinstance(one, Zones) for one in gone)
        assert (queue.dropped, len(queue)) == (dropped, len(plain))
        match rng.randrange(6):
            case 0 | 1:
                for _ in range(min(rng.randrange(5), len(plain))):
                    assert times([queue.pop()]) == times([plain.pop(0)])
            case 2:
                head = next((at for at, one in enumerate(plain) if isinstance(one, Exception)), len(plain))
                found = frames_in(queue.pop_frames())
                assert times(found) == times(plain[:head])
                plain = plain[head:]
            case 3 if not any(isinstance(one, Exception) for one in plain):
                queue.keep_last()
                plain = plain[-1:]
        assert (queue.first_error() is None) == (not plain or not isinstance(plain[0], Exception))
    assert times(iter(queue.pop, None)) == times(plain)


@pytest.mark.parametrize("take", [FrameQueue.pop, FrameQueue.pop_frames])
def test_one_frame_is_not_both_shown_and_taken(take):
    """The C reader's `latest()` shows a frame without the board's lock, as another thread takes the next one."""
    queue, drop, shown = FrameQueue(4), FrameQueue._drop_shown, []
    queue.put(next(runs_and_errors(random.Random(1), 1)))
    thread = threading.Thread(target=lambda: shown.append(queue.show(1)))

    def drop_and_pause():
        drop(queue)
        thread.start()
        thread.join(0.2)  # in which it is shown, unless that has to wait

    queue._drop_shown = drop_and_pause
    assert take(queue) is not None
    thread.join()
    assert shown == [False]
