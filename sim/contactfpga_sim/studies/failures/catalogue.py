"""All studies, in the order of the page."""

from __future__ import annotations

from contactfpga_sim.studies.failures import electric, line, lines, shapes, touch

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
"""Every study by its name."""
