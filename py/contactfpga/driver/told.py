"""What is told between frames."""

from contactfpga.wire.faults import Faults, SelfTestSlot

Told = Faults | SelfTestSlot
