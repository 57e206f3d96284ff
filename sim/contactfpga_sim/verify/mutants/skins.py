"""Skins that together contain the logic of every option."""

from typing import Any

from contactfpga.skin import Skin
from contactfpga.skin.several import Several

# Slow clocks bring what comes once in half a second within reach.
SKINS: dict[str, Skin] = {
    "8x8": Skin(rows=8, columns=8, clock_hz=1_000_000, baud=250_000, settle_us=30.0),
    "8x8, 4-connectivity": Skin(
        rows=8,
        columns=8,
        connectivity=4,
        diodes="row2col",
        mask=((0, 0), (7, 7), *((row, 3) for row in range(8))),
        zone_capacity=5,
        clock_hz=2_000_000,
        baud=250_000,
        settle_us=20.5,
        release_us=1.5,
    ),
    "4x4, debounced": Skin(
        rows=4,
        columns=4,
        debounce="sym_defer_pk",
        debounce_press_us=250.0,
        debounce_release_us=150.0,
        send="on_change",
        keep_alive_ms=0.7,
        clock_hz=1_000_000,
        baud=500_000,
        settle_us=20.0,
        release_us=2.0,
    ),
    "5x6, eager, 4-connectivity": Skin(
        rows=5,
        columns=6,
        connectivity=4,
        debounce="asym_eager_defer_pk",
        debounce_press_us=400.0,
        debounce_release_us=200.0,
        mask=((2, 1), (4, 5)),
        zone_capacity=1,
        clock_hz=1_000_000,
        baud=500_000,
        settle_us=28.0,
    ),
    "5x9, cells": Skin(
        rows=5,
        columns=9,
        diodes="row2col",
        report="cells",
        send="on_change",
        keep_alive_ms=1.0,
        mask=((1, 1),),
        clock_hz=1_000_000,
        baud=500_000,
        settle_us=14.0,
        release_us=3.0,
    ),
    "4x4, fast": Skin(rows=4, columns=4, clock_hz=1_000_000, baud=250_000, settle_us=10.0, release_us=1.0),
    "64x32, cells, shift registers": Skin(
        rows=64,
        columns=32,
        report="cells",
        row_drive="74hc595",
        row_chains=2,
        column_read="74hc165",
        column_chains=4,
        shift_hz=500_000,
        clock_hz=1_000_000,
        baud=500_000,
        settle_us=80.0,
        release_us=30.0,
    ),
    "6x7, serial": Skin(
        rows=6,
        columns=7,
        labeller="serial",
        mask=((2, 3),),
        zone_capacity=6,
        clock_hz=1_000_000,
        baud=250_000,
        settle_us=24.0,
        release_us=2.0,
    ),
    "5x6, reversal": Skin(
        rows=5,
        columns=6,
        scan="reversal",
        settle_us=3.0,
        release_us=1.0,
        precharge_us=2.0,
        project_us=4.0,
        debounce="sym_defer_pk",
        debounce_press_us=40.0,
        debounce_release_us=70.0,
        mask=((1, 4), *((row, 2) for row in range(5))),
        send="on_change",
        keep_alive_ms=4.5,
        clock_hz=1_000_000,
        baud=250_000,
    ),
    "4x5, cells, reversal": Skin(
        rows=4,
        columns=5,
        diodes="row2col",
        scan="reversal",
        settle_us=2.0,
        release_us=1.0,
        precharge_us=1.0,
        project_us=1.0,
        report="cells",
        mask=tuple((1, column) for column in range(5)),
        clock_hz=1_000_000,
        baud=250_000,
    ),
    "4x4, precharge": Skin(
        rows=4,
        columns=4,
        settle_us=20.0,
        release_us=2.0,
        precharge_us=3.0,
        mask=tuple((row, 1) for row in range(4)),
        clock_hz=1_000_000,
        baud=250_000,
    ),
    "1x5, slow": Skin(rows=1, columns=5, clock_hz=1_000_000, baud=100_000, settle_us=9_000.0, release_us=1_000.0),
}

_TINY: dict[str, Any] = {"clock_hz": 1_000_000, "baud": 250_000, "release_us": 2.0}
_AROUND: dict[str, Any] = {"surface": "cylinder", "radius_mm": 25.0, "closed": True}

OPTIONS: dict[str, tuple[Skin, tuple[str, ...]]] = {
    "3x4, guard": (
        Skin(rows=3, columns=4, guard=True, fail_safe=True, alive=True, mask=((1, 1),), settle_us=16.0, **_TINY),
        ("guard", "faults", "top"),
    ),
    "5x3, guard, shift registers": (
        Skin(
            rows=5,
            columns=3,
            guard=True,
            row_drive="74hc595",
            row_chains=2,
            column_read="74hc165",
            column_chains=2,
            debounce="sym_defer_pk",
            debounce_press_us=700.0,
            debounce_release_us=900.0,
            clock_hz=1_000_000,
            baud=250_000,
            settle_us=30.0,
            release_us=2.0,
        ),
        ("guard", "scan"),
    ),
    "3x4, reversal, guard, self-test": (
        Skin(
            rows=3,
            columns=4,
            scan="reversal",
            guard=True,
            self_test=True,
            fail_safe=True,
            alive=True,
            mask=((1, 1),),
            precharge_us=1.0,
            project_us=2.0,
            send="on_change",
            keep_alive_ms=4.5,
            settle_us=2.0,
            release_us=1.0,
            clock_hz=1_000_000,
            baud=250_000,
        ),
        ("guard", "self-test", "faults", "top"),
    ),
    "4x2, reversal, self-test": (
        Skin(
            rows=4,
            columns=2,
            scan="reversal",
            self_test=True,
            diodes="row2col",
            report="cells",
            mask=((2, 0), (2, 1)),
            precharge_us=1.0,
            send="on_change",
            keep_alive_ms=4.5,
            project_us=1.0,
            settle_us=3.0,
            release_us=1.0,
            clock_hz=1_000_000,
            baud=500_000,
        ),
        ("self-test", "serial"),
    ),
    "3x4, cells, sample at": (
        Skin(rows=3, columns=4, report="cells", settle_us=16.0, **_TINY),
        ("scan", "serial"),
    ),
    "2x2, units": (
        Skin(
            rows=2,
            columns=2,
            units=3,
            unit_sums=((1, 1, 1), (127, -127, 3), (0, 0, -5), (1, -2, 1)),
            fail_safe=True,
            settle_us=14.0,
            **_TINY,
        ),
        ("units", "top"),
    ),
    "2x2, units at their own pace": (
        Skin(
            rows=2,
            columns=2,
            units=2,
            converter="ads131m08",
            unit_sums=((1, 1), (3, -127)),
            fail_safe=True,
            settle_us=14.0,
            **_TINY,
        ),
        ("units", "top"),
    ),
    "6x7, closed": (Skin(rows=6, columns=7, settle_us=30.0, **_AROUND, **_TINY), ("closed", "label")),
    "5x5, closed, serial": (
        Skin(rows=5, columns=5, labeller="serial", settle_us=30.0, **_AROUND, **_TINY),
        ("closed", "label"),
    ),
}
"""Skins of options, and the stages that the option changes."""

_CHAINED: dict[str, Any] = {"row_drive": "74hc595", "column_read": "74hc165", "settle_us": 30.0} | _TINY

SEVERAL: dict[str, tuple[Several, tuple[str, ...]]] = {
    "two sheets": (
        Several(
            (
                Skin(rows=2, columns=3, send="on_change", keep_alive_ms=5.0, **_CHAINED),
                Skin(rows=3, columns=2, report="cells", diodes="row2col", row_order=(2, 0, 1), **_CHAINED),
            )
        ),
        ("several", "serial", "link"),
    ),
    "three sheets, requests as pulses": (
        Several(
            (
                Skin(rows=2, columns=2, report="cells", **_CHAINED | {"baud": 500_000}),
                Skin(rows=1, columns=3, labeller="single", send="on_change", **_CHAINED | {"baud": 500_000}),
                Skin(rows=2, columns=2, **_CHAINED | {"baud": 500_000}),
            )
        ),
        ("several", "serial", "link"),
    ),
}
"""Sheets on one FPGA, and the mutated stages."""
