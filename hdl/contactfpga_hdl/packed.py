"""LUT4 of gateware by itself, in seconds: synthesised and packed, but neither placed nor routed."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Callable
from pathlib import Path

from amaranth.lib import wiring

from contactfpga_hdl import sizes
from contactfpga_hdl.sizes import Device


def luts(component: Callable[[], wiring.Component], device: Device) -> int:
    """LUT4 of what ``component`` makes, as :func:`contactfpga_hdl.sizes.measure` gives them."""
    with tempfile.TemporaryDirectory(prefix=".sizes-", dir=Path.cwd()) as name:  # these tools do not see /tmp
        folder = Path(name)
        sizes._synthesise(component(), device, folder)
        log = sizes._run(folder, *device.place, "--json", "netlist.json", "--pack-only")
    return sum(map(int, re.findall(device.counts[0], log)))
