"""The arm's charts: what latency costs, point by point."""

import dataclasses
import math
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from contactfpga_sim.apps import result_cache
from contactfpga_sim.lab.arm import pictures, sweep
from contactfpga_sim.lab.arm.case import Case
from contactfpga_sim.lab.arm.run import run

PAPER = Case.load("paper")


@pytest.fixture
def nothing_kept(tmp_path, monkeypatch):
    monkeypatch.setattr(result_cache, "cache_folder", lambda: tmp_path / "kept")


def test_safe_speed_lies_where_the_worst_force_so_far_crosses_the_limit():
    speeds = np.array([0.1, 0.2, 0.3, 0.4])
    forces = np.array([5.0, 10.0, 8.0, 20.0])
    assert sweep.safe_speed(speeds, forces, 7.5) == pytest.approx(0.15)
    assert sweep.safe_speed(speeds, forces, 15.0) == pytest.approx(0.35)
    assert math.isnan(sweep.safe_speed(speeds, forces, 4.9))
    assert math.isnan(sweep.safe_speed(speeds, forces, 20.0))


@pytest.mark.slow
def test_charts_of_a_few_points(nothing_kept, tmp_path):
    tasks = pictures.plan(PAPER, latencies=(1e-3, 6e-3), speeds=(0.1, 0.23))
    few = dataclasses.replace(tasks, sheet={}, speed={"6 ms": tasks.speed["6 ms"]})
    steps = []
    with ThreadPoolExecutor(1) as workers:
        points = sweep.sweep(few.all, workers, lambda name, of: steps.append(of))
    assert steps == [len(few.all)] * len(few.all)
    found = dict(zip(few.all, points, strict=True))
    at = found[few.force[1]]
    set_run = run(sweep.unlimited(PAPER), "latency", latency_s=6e-3).outcome
    assert at.peak_force_n == pytest.approx(set_run.peak_force_n, rel=1e-3)
    assert at.force_before_n == pytest.approx(set_run.force_before_n, rel=1e-3)
    assert at.takes_s == pytest.approx(6e-3, abs=1e-9)
    slow, fast = (found[task] for task in few.speed["6 ms"])
    assert slow.peak_force_n < fast.peak_force_n == pytest.approx(at.peak_force_n)
    drawn = dataclasses.replace(few, sheet={"uart": few.force[:1], "pin": few.force[:1]})
    assert "paper: 12 N when it reacts, after 6 ms" in pictures.draw(PAPER, drawn, found, tmp_path).read_text()
