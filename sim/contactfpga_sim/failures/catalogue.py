"""All studies, in the order of the page."""

from __future__ import annotations

from contactfpga_sim.failures import electric, shapes, touch, wire

STUDIES = {
    study.name: study
    for study in (
        shapes.WINDING,
        shapes.CROSSING,
        shapes.MANY,
        touch.CLOSING,
        touch.MOVING,
        touch.BOUNCE,
        electric.SETTLE,
        electric.DIODES,
        electric.GHOST,
        electric.GHOSTS,
        electric.BROKEN,
        electric.STUCK,
        wire.BAUD,
        wire.NOISE,
        wire.HOST,
        wire.CLOCK,
    )
}
"""Every study by its name."""
