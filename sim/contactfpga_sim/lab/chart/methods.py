"""Methods and settings of the chart, on sheets of one extent."""

from __future__ import annotations

import dataclasses
from typing import Any, NamedTuple

from contactfpga.choices.labellers import LABELLERS, Labeller
from contactfpga.design.cover import Cover
from contactfpga.skin import Skin
from contactfpga_sim.apps.covers import COVERS, DOME, sheet, tiled

PITCHES_MM = (6.4, 8.0, 10.0, 20.0, 5.0)
"""Pitches; the first compares methods."""

PITCH_MM = PITCHES_MM[0]

THRESHOLDS_N = (0.2, 0.6, 1.0)
"""Closing forces besides :data:`contactfpga_sim.apps.covers.DOME`'s 0.4 N."""


class Method(NamedTuple):
    skin: Skin
    cover: Cover | None
    """Cover; None is a bare sheet, whose switches close at any force if their middles are under a contact."""


def under(cover: str, name: str, pitch_mm: float, more: str = "", **settings: Any) -> dict[str, Method]:
    whole = f"{name}, {pitch_mm:g} mm, {cover}" + (f", {more}" if more else "")
    return {whole: Method(sheet(pitch_mm, **settings), COVERS[cover](pitch_mm))}


def by(labeller: Labeller) -> dict[str, Method]:
    found: dict[str, Method] = {}
    for pitch in PITCHES_MM:
        found |= under("tiles", labeller.title, pitch, labeller=labeller)
    return found


def _covers() -> dict[str, Method]:
    methods: dict[str, Method] = {}
    for cover in ("caps", "paper", "bare"):
        methods |= under(cover, "run", PITCH_MM)
    for force in THRESHOLDS_N:
        switch = dataclasses.replace(DOME, force_n=force)
        methods[f"run, {PITCH_MM:g} mm, tiles, {force:g} N"] = Method(sheet(PITCH_MM), tiled(PITCH_MM, switch))
    return methods


def _methods() -> dict[str, Method]:
    return by(LABELLERS["run"]) | _covers() | _settings() | _reversal()


def _settings() -> dict[str, Method]:
    debounced: dict[str, Any] = {"debounce": "sym_defer_pk", "debounce_press_us": 500.0, "debounce_release_us": 500.0}
    ways: list[tuple[str, str, dict[str, Any]]] = [
        ("run", "8-connected", {"connectivity": 8}),
        *((one.title, "", {"labeller": one}) for one in LABELLERS.values() if one.name != "run"),
        ("cells", "", {"report": "cells"}),
        ("barycenter", "", {"report": "barycenter", "barycenter_bits": 4}),
        ("run", "1 Mbaud", {"baud": 1_000_000}),
        ("run", "debounced 0.5 ms", debounced),
    ]
    found: dict[str, Method] = {}
    for name, more, settings in ways:
        found |= under("tiles", name, PITCH_MM, more, **settings)
    return found


def _reversal() -> dict[str, Method]:
    fast: dict[str, Any] = {
        "scan": "reversal", "precharge_us": 0.25, "release_us": 0.05, "send": "on_change",
        "clock_hz": 24_000_000, "baud": 12_000_000,
    }  # fmt: skip
    longer: dict[str, Any] = {"settle_us": 0.8, "project_us": 2.5}
    return (
        under("tiles", "reversal", PITCH_MM, **fast, **longer)
        | under("tiles", "reversal", 10.0, **fast, settle_us=0.5)
        | under("tiles", "reversal", 5.0, **fast, **longer)
    )


METHODS: dict[str, Method] = _methods()

SHEETS = under("tiles", "run", PITCH_MM) | _covers()
"""Methods that differ in cover and closing force; the benchmark has pitches."""
