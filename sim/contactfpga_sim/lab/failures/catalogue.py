"""All knobs, in the page's order."""

from __future__ import annotations

from contactfpga_sim.lab.failures import electric, line, touch

KNOBS = {
    knob.name: knob
    for knob in (
        touch.WINDING,
        touch.CROSSING,
        touch.MANY,
        touch.CLOSING,
        touch.LIGHT,
        touch.MOVING,
        touch.BOUNCE,
        electric.SETTLE,
        electric.SETTLE_REVERSAL,
        electric.PROJECT_REVERSAL,
        electric.DIODES,
        electric.DIODES_REVERSAL,
        electric.GHOST,
        electric.GHOSTS,
        electric.BROKEN,
        electric.BROKEN_REVERSAL,
        electric.STUCK,
        electric.STUCK_REVERSAL,
        line.BAUD,
        line.NOISE,
        line.HOST,
        line.SILENCE,
        line.CLOCK,
    )
}
