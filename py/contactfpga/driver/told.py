"""What is told between frames."""

from contactfpga.wire.faults import Faults, SelfTestSlot
from contactfpga.zones.units import UnitSamples

Told = Faults | SelfTestSlot | UnitSamples
