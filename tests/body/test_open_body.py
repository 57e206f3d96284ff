"""An open body, whose boards come and go."""

from __future__ import annotations

import asyncio
import json
import threading

import pytest
from fake_board import wait_until
from two_links import PluggedPorts

import contactfpga
from contactfpga.robot.body import Body, NoJoints, NoLinkData, OpenBody
from contactfpga.robot.body.reader import States

LONG = 60.0  # s; what has to come comes at once, but for a machine that is busy


def test_joints_that_fail_say_so_where_angles_are_needed(patient):
    def joints(_):
        raise KeyError("elbow")

    plugged = PluggedPorts()
    with OpenBody(Body.load(patient), joints, opened=plugged.opened) as body, body.subscribe() as queue:
        first = queue.next(LONG)
        assert queue.next(LONG).host_time_s > first.host_time_s  # its threads go on
        snapshot = body.read(LONG)
        assert set(snapshot.answering) == {"arm", "chest"}
        with pytest.raises(NoJoints, match=r"^link 'arm': the joints given to the body failed: KeyError\('elbow'\)"):
            snapshot.contacts()
        assert snapshot.contacts("link") is not None


def statuses(body):
    return {name: state.status for name, state in body.latest().links.items()}


def test_open_body_goes_on_without_a_link_and_takes_it_back(patient, leap):
    plugged = PluggedPorts()
    with OpenBody(Body.load(patient), lambda _: {"elbow": 0.0}, opened=plugged.opened) as body:
        assert len(body.read(LONG).contacts()) == 2
        port = plugged.ports.pop("a")
        port.read = lambda seconds: (_ for _ in ()).throw(contactfpga.PortLost("a is gone"))
        wait_until(lambda: body.latest().links["arm"].status == "lost")
        snapshot = body.read(LONG)
        with pytest.raises(NoLinkData, match=r"no data of arm: lost \(.*a is "):
            snapshot.contacts()
        assert [one.link for one in snapshot.contacts(links=snapshot.answering)] == ["chest"]
        plugged.plug("a")
        wait_until(lambda: body.latest().links["arm"].status == "ok")
        assert len(body.next(LONG).contacts()) == 2
        plugged.ports["b"].mute = True
        leap(100.0)
        wait_until(lambda: statuses(body) == {"arm": "ok", "chest": "silent"})
        assert body.latest().links["chest"].zones is None
    with pytest.raises(contactfpga.BoardClosed):
        body.latest()


def test_read_waits_for_frames_scanned_after_the_call(patient):
    plugged = PluggedPorts()
    with OpenBody(Body.load(patient), opened=plugged.opened) as body:
        body.read(LONG)
        for port in plugged.ports.values():
            port.moments = [(9, 9, 9)]
        found = body.read(LONG)
        assert [one.zone.area_cells for one in found.contacts("link")] == [9, 9]


def test_subscription_gets_each_change_in_order_and_counts_what_it_drops(patient):
    plugged = PluggedPorts()
    with OpenBody(Body.load(patient), opened=plugged.opened) as body:
        with body.subscribe(maxsize=8) as queue:
            times = [queue.next(LONG).host_time_s for _ in range(5)]
            wait_until(lambda: queue.dropped > 3)
        assert times == sorted(times)
        with pytest.raises(ValueError, match="maxsize is 0"):
            body.subscribe(0)


def test_a_snapshot_that_waited_tells_of_its_moment_and_is_made_when_it_is_looked_at(patient, leap, monkeypatch):
    made, make = [], States.__getitem__
    monkeypatch.setattr(States, "__getitem__", lambda self, name: made.append(name) or make(self, name))
    plugged = PluggedPorts()
    with OpenBody(Body.load(patient), opened=plugged.opened) as body:
        body.read(LONG)
        with body.subscribe() as queue:
            changes = body._changes.count
            wait_until(lambda: body._changes.count > changes + 20)
            assert made == []
            waited = queue.next(LONG)
            plugged.ports["b"].mute = True
            leap(100.0)
            wait_until(lambda: statuses(body) == {"arm": "ok", "chest": "silent"})
        made.clear()
        assert {state.status for state in waited.links.values()} == {"ok"}
        assert made == ["arm", "chest"]
        for state in waited.links.values():
            assert 0 <= state.age_s == pytest.approx(waited.host_time_s - state.frame_s, abs=1e-9)
        newest = body.latest()
        assert newest.links["chest"].zones is None
        assert newest.links["arm"].zones.time_us > waited.links["arm"].zones.time_us


def test_it_is_iterated_as_a_board_is(patient):
    async def first(source, count):
        found = []
        async for snapshot in source:
            found.append(snapshot.host_time_s)
            if len(found) == count:
                break
        return found

    with OpenBody(Body.load(patient), opened=PluggedPorts().opened) as body:
        with body.subscribe() as queue:
            for source in (body, queue):
                synchronous = [snapshot.host_time_s for snapshot, _ in zip(source, range(5))]
                assert len(set(synchronous)) == 5
                found = asyncio.run(first(source, 5))
                assert found == sorted(set(found))


def test_batch_holds_each_frame_of_each_link_once(patient):
    batches = []
    with OpenBody(Body.load(patient), opened=PluggedPorts().opened) as body:
        body.read(LONG)
        wait_until(lambda: batches.append(body.batch(0.05, LONG)) or len(batches[-1]) > 1)
        later = body.batch(0.05, LONG)
    for name, one in later.links.items():
        assert one.first == sum(len(batch.links[name]) for batch in batches)
    batch = batches[-1]
    assert [one.host_time_s for one in batch] == sorted(one.host_time_s for one in batch)
    assert set(batch.links) == {"arm", "chest"}
    for name, arrays in batch.links.items():
        seen = {one.links[name].zones.time_us for one in batch if one.links[name].zones is not None}
        assert arrays.frames["time_us"].tolist() == sorted(seen)
        assert len(arrays.zones) == len(seen), "each frame has one zone"


def test_stats_go_on_where_a_board_comes_back(patient):
    plugged = PluggedPorts()
    with OpenBody(Body.load(patient), opened=plugged.opened) as body:
        wait_until(lambda: body.stats.links["arm"].frames > 5)
        port = plugged.ports.pop("a")
        port.read = lambda seconds: (_ for _ in ()).throw(contactfpga.PortLost("a is gone"))
        wait_until(lambda: body.latest().links["arm"].status == "lost")
        before = body.stats.links["arm"]
        plugged.plug("a")
        wait_until(lambda: body.stats.links["arm"].frames > before.frames)
        assert body.stats.links["arm"].hellos > before.hellos
        stats = body.stats
        assert stats.frames == sum(one.frames for one in stats.links.values())
        assert stats.damaged == {}
        assert set(json.loads(json.dumps(stats.to_dict()))["links"]) == {"arm", "chest"}
    assert body.stats.frames >= stats.frames, "as a board's, they stay when it is closed"


def test_closing_wakes_who_waits_and_ends_all_threads(patient):
    plugged = PluggedPorts()
    before = threading.active_count()
    body = OpenBody(Body.load(patient), opened=plugged.opened)
    queue = body.subscribe()
    body.close()
    body.close()
    with pytest.raises(contactfpga.BoardClosed):
        queue.next(LONG)
    assert threading.active_count() == before


def test_link_whose_code_fails_is_lost_and_says_why(patient):
    plugged = PluggedPorts()

    def opened(plan):
        if plan.name == "arm":
            raise ZeroDivisionError("of a scene")
        return plugged.opened(plan)

    with OpenBody(Body.load(patient), opened=opened) as body:
        assert str(body.latest().links["arm"]) == "lost (no frame yet; of a scene)"
        assert body.read(LONG).answering == ("chest",)
