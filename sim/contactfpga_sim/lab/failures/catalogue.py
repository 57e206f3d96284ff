"""All studies, in the order of the page."""

from __future__ import annotations

from contactfpga_sim.lab.failures import electric, electric_reversal, line, lines, shapes, touch

KNOBS = {
    knob.name: knob
    for knob in (
        shapes.WINDING,
        shapes.CROSSING,
        shapes.MANY,
        touch.CLOSING,
        touch.MOVING,
        touch.BOUNCE,
        electric.SETTLE,
        electric_reversal.SETTLE_REVERSAL,
        electric_reversal.PROJECT_REVERSAL,
        electric.DIODES,
        electric_reversal.DIODES_REVERSAL,
        electric.GHOST,
        electric.GHOSTS,
        lines.BROKEN,
        lines.BROKEN_REVERSAL,
        lines.STUCK,
        lines.STUCK_REVERSAL,
        line.BAUD,
        line.NOISE,
        line.HOST,
        line.SILENCE,
        line.CLOCK,
    )
}
"""Every knob by its name."""
