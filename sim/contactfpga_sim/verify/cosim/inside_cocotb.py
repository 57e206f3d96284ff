"""The test in cocotb's simulator: drive the pins, record the probes."""

from __future__ import annotations

import os
import pickle
import time
from pathlib import Path
from typing import Any

import cocotb
from cocotb.clock import Clock
from cocotb.triggers import FallingEdge, Timer

from contactfpga_sim.verify.cosim.record import LEVELS, PAYLOADS, InputDriver, TraceRecorder, ports


@cocotb.test()
async def record(dut: Any) -> None:
    """Record every cycle in its second half, when the design has settled."""
    job = pickle.loads(Path(os.environ["CONTACTFPGA_JOB"]).read_bytes())
    recorder = TraceRecorder(job["cycles"])
    stimulus = InputDriver(job["skin"], job["timeline"])
    levels = {LEVELS.index(name): getattr(dut, name) for name in ports(LEVELS, job["skin"])}
    payloads = {name: getattr(dut, name) for name in ports(PAYLOADS, job["skin"])}
    deadline = time.monotonic() + job["limit_s"]
    reads = {name: getattr(dut, name) for name in stimulus.reads}
    drives = [getattr(dut, name) for name in stimulus.drives]
    driven = None

    dut.rst.value = 0
    for handle in drives:
        handle.value = 0
    dut.clk.value = 0
    await Timer(1, "ns")
    falling = FallingEdge(dut.clk)
    for cycle in range(job["cycles"]):
        if cycle == 1:
            Clock(dut.clk, 10, "ns", impl="gpi").start(start_high=True)
        if cycle:
            await falling
        pins = stimulus.pins(cycle, {name: int(handle.value) for name, handle in reads.items()})
        if pins != driven:
            driven = pins
            for handle, value in zip(drives, pins, strict=True):
                handle.value = value
        level = sum(int(handle.value) << place for place, handle in levels.items())
        recorder.note(cycle, level, lambda name: int(payloads[name].value))
        if cycle % 256 == 0 and time.monotonic() > deadline:
            raise TimeoutError(f"{cycle} of {job['cycles']} cycles simulated in {job['limit_s']:g} s")
    Path(job["trace"]).write_bytes(pickle.dumps(recorder.trace))
