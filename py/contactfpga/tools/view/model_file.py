"""Limits of a MuJoCo model from a file: it is loaded by a process of its own first.

A few words of MJCF, such as a ``<replicate>`` or a ``<flexcomp>``, ask for any amount of memory and time, and no reader
tells how much before it builds them. Run as a program, this module loads one model and prints what is wrong with it.
"""

from __future__ import annotations

import contextlib
import operator
import os
import subprocess
import sys
import tempfile

import numpy as np

from contactfpga.errors import ContactFPGAError
from contactfpga.inputs.values import shortened

MOST_BYTES, MOST_S, WAIT_S = 2 << 30, 20, 120
"""Memory, which only Linux limits, processor time, and time in all for loading a model."""
ITERATIONS = (
    "opt.iterations",
    "opt.ls_iterations",
    "opt.noslip_iterations",
    "opt.ccd_iterations",
    "opt.sdf_iterations",
)
LIMITS = {"opt.timestep": (1e-5, 0.1), "ngeom": (0, 1000), "nmeshface": (0, 500_000), "nhfielddata": (0, 250_000)}
LIMITS |= dict.fromkeys(ITERATIONS, (0, 1000)) | dict.fromkeys(("nbody", "nv"), (0, 10_000))
"""Least and most of a model's attributes."""
BEYOND = f"takes more than {MOST_BYTES >> 30} GiB or {MOST_S} s of processor time to load; make the model smaller"


def check(path: str) -> None:
    """Raises :class:`~contactfpga.ContactFPGAError` for a model that is beyond a limit, or that MuJoCo refuses."""
    call = [sys.executable, "-P", "-m", __name__, os.path.abspath(path)]
    env = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}  # each thread's buffer counts as memory
    # MuJoCo writes its log where it runs.
    with tempfile.TemporaryDirectory() as folder, contextlib.suppress(subprocess.TimeoutExpired):
        found = subprocess.run(
            call, cwd=folder, env=env, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=WAIT_S
        )
        if not found.returncode:
            return
        if said := found.stdout.strip():
            raise ContactFPGAError(f"{path}: {shortened(said)}")
    raise ContactFPGAError(f"{path} {BEYOND}")


def _fault(path: str) -> str:
    """What is wrong with a model, if anything. Raises any error where memory ends."""
    import mujoco

    try:
        model = mujoco.MjSpec.from_file(path).compile()
    except (ValueError, mujoco.FatalError) as error:
        if "allocate" in str(error):
            raise MemoryError from error
        return f"MuJoCo says {' '.join(str(error).split())}"
    for name, (least, most) in LIMITS.items():
        if not least <= (value := operator.attrgetter(name)(model)) <= most:
            return f"{name.removeprefix('opt.')} is {value}; it must be {least} to {most}"
    arrays = {name: getattr(model, name) for name in filter(str.islower, dir(model))}
    floats = {name: one for name, one in arrays.items() if isinstance(one, np.ndarray) and one.dtype.kind == "f"}
    if wrong := [name for name, values in floats.items() if not np.isfinite(values).all()]:
        return f"not all of {', '.join(wrong)} are finite numbers"
    mujoco.mj_forward(model, mujoco.MjData(model))
    return ""


if __name__ == "__main__":
    for kind, most in (("CORE", 0), ("CPU", MOST_S), ("AS", MOST_BYTES)):
        with contextlib.suppress(ImportError, OSError, ValueError):  # no Unix, or no such limit there
            import resource

            resource.setrlimit(getattr(resource, f"RLIMIT_{kind}"), (most, most))
    print(fault := _fault(sys.argv[1]))
    sys.exit(bool(fault))
