"""Boards of closed sheets: in lockstep with the golden model, from the pins to what a program reads."""

import numpy as np
import pytest
from sample import sample

from contactfpga import Batch, Skin
from contactfpga.tracking.tracker import Tracker
from contactfpga.wire.protocol import PacketError, check_prefix, decode_frame, unseal
from contactfpga.wire.table import decode
from contactfpga.zones import around
from contactfpga.zones.run import Run
from contactfpga.zones.zone import Zones
from contactfpga_sim.model.board import replay
from contactfpga_sim.model.golden import Timeline, predict
from contactfpga_sim.model.golden.facts import facts
from contactfpga_sim.model.golden.zones import closed_flood
from contactfpga_sim.verify.cosim import bench_amaranth
from contactfpga_sim.verify.cosim.compare import compare
from contactfpga_sim.verify.cosim.covering import CHOICES, REVERSAL, closed, pairwise, skin_for, stimulus

CLOSED = {"surface": "cylinder", "radius_mm": 25.0, "closed": True}
SKINS = {
    "run": Skin(rows=6, columns=7, settle_us=3.0, **CLOSED),
    "serial, 4": Skin(rows=4, columns=3, labeller="serial", connectivity=4, settle_us=4.0, **CLOSED),
    "cells": Skin(rows=4, columns=6, report="cells", labeller="single", **CLOSED),
}


COVERING = {scan: pairwise(closed(choices)) for scan, choices in (("raster", CHOICES), ("reversal", REVERSAL))}
EVERY = [(scan, number) for scan, chosen in COVERING.items() for number in range(len(chosen))]


@pytest.mark.parametrize(("scan", "number"), sample(EVERY, quick=EVERY[::13]))
def test_covering_set_in_amaranths_simulator(scan, number):
    skin = skin_for(COVERING[scan][number])
    cycles = 2_000
    timeline = stimulus(skin, cycles, seed=number)
    expected = predict(skin, timeline, cycles)
    assert compare(expected, bench_amaranth.run(skin, timeline, cycles)) > 100


def frames_of(skin, trace):
    """(packet, frame) of each frame on the wire."""
    packets = bytes(value for _, value in trace.bytes).split(b"\0")[:-1]
    for packet in packets:
        try:
            yield packet, decode_frame(unseal(packet, check_prefix(skin)), skin.derived)
        except PacketError:
            continue


@pytest.mark.parametrize("name", ["run", "serial, 4", "cells"])
def test_what_programs_read_is_a_flood_of_the_cylinder(name):
    skin = SKINS[name]
    cycles = 30_000
    rng = np.random.default_rng(3)
    scan = facts(skin).scan_clocks
    shape = skin.rows, skin.columns
    pieces = [(i * 2 * scan, rng.random(shape) < rng.choice([0.2, 0.5, 0.8]), None) for i in range(40)]
    trace = predict(skin, Timeline(pieces), cycles)
    found = dict(frames_of(skin, trace))
    assert len(found) > 20
    seen = {
        (zone.area_cells, zone.x_mm, zone.y_mm, zone.winding)
        for frame in found.values()
        for zone in Zones(frame, skin.sheet)
    }
    wanted = set()
    for _, cells, _ in pieces:
        wanted |= set(expected_zones(skin, cells))
    assert seen <= wanted
    assert {"", "ring"} <= {zone[3] for zone in seen}
    assert all((x is None) == bool(winding) for _, x, _, winding in seen)
    of_frames = (Zones(frame, skin.sheet) for frame in found.values())
    rings = next(zones for zones in of_frames if any(zone.winding for zone in zones))
    assert Tracker(gate_mm=5.0).update(rings).unsure == tuple(zone for zone in rings if zone.winding)
    if skin.report == "moments":
        check_arrays(skin, found)


def expected_zones(skin, cells):
    labels, turned = closed_flood(cells, skin.connectivity)
    for zone, past in enumerate(turned, 1):
        y, x = np.nonzero(labels == zone)
        winding = "ring" if past == len(x) else "wound" if past > len(x) else ""
        unwrapped = (int(x.sum()) + skin.columns * past) % (skin.columns * len(x)) / len(x) * skin.pitch_x_mm
        yield len(x), None if winding else unwrapped, y.sum() / len(y) * skin.pitch_y_mm, winding


def check_arrays(skin, found):
    """Read many at once, the same."""
    table = decode(list(found), skin.derived, check_prefix(skin))
    assert table.packets["valid"].all()
    run = Run(skin.sheet, table.packets, table.starts, table.records, table.packets["time_us"], None)
    batch, one_by_one = Batch.of([run]), Batch.of([Zones(frame, skin.sheet) for frame in found.values()])
    for name in batch.zones.dtype.names:
        has_nan = batch.zones.dtype[name].base == np.float64
        assert np.array_equal(batch.zones[name], one_by_one.zones[name], equal_nan=has_nan)
    for frame, zones in enumerate(run):
        rows = batch.zones[batch.zones["frame"] == frame]
        assert [zone.winding for zone in zones] == rows["winding"].tolist()
        assert np.array_equal(zones.array["x_mm"], rows["x_mm"], equal_nan=True)
        assert zones.to_dict()["zones"] == [zones._as_dict(zone) for zone in zones]
    assert around.WINDINGS[1] in batch.zones["winding"]


def test_replay_takes_the_circumference_of_its_pitch():
    skin = replay.skin_for(4, 6, 8, zones=3, pitch_mm=5.0, closed=True)
    assert (skin.closed, skin.pitch_x_mm, skin.pitch_y_mm) == (True, pytest.approx(5.0), 5.0)
