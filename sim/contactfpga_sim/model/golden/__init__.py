"""Golden model: zones by flood fill, times by docs/timing.md.

The golden model shares no code with the gateware or the host's protocol, never imports Amaranth, and reads only a
Skin's declared fields.
"""

from contactfpga_sim.model.golden.predict import beginnings, driven, predict
from contactfpga_sim.model.golden.request import request, requests
from contactfpga_sim.model.golden.trace import BOUNDARIES, Timeline, Trace, boundaries
from contactfpga_sim.model.golden.volume import Departures, all_departures, last_record_clocks, row_clocks
from contactfpga_sim.model.golden.zones import zones

__all__ = [
    "BOUNDARIES",
    "Departures",
    "Timeline",
    "Trace",
    "all_departures",
    "beginnings",
    "boundaries",
    "driven",
    "last_record_clocks",
    "predict",
    "request",
    "requests",
    "row_clocks",
    "zones",
]
