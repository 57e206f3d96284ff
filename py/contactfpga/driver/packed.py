"""What comes from a board as the bytes of a message, from the process that reads the port to the one that uses it."""

from __future__ import annotations

import marshal
import pickle
from collections.abc import Mapping
from typing import Any

import numpy as np

from contactfpga.driver.conversation import Arrival
from contactfpga.errors import ContactFPGAError
from contactfpga.skin.sheet import Sheet
from contactfpga.wire.faults import STUCK
from contactfpga.wire.many import FIELDS
from contactfpga.wire.protocol import FLAG_SETS, Frame, no_records
from contactfpga.zones.run import Run
from contactfpga.zones.units import UnitHistory
from contactfpga.zones.zone import HostLine, Zones

_FLAG_WORDS = {flags: word for word, flags in enumerate(FLAG_SETS)}

Packed = tuple[Any, ...]


def pack_frame(arrival: Arrival, sheet: int, history: int) -> bytes:
    """A frame; ``sheet`` and ``history`` are the numbers by which the other process knows what it belongs to."""
    zones = arrival.zones
    before, line = zones._before, zones._line
    return marshal.dumps(
        (
            sheet,
            history,
            zones.time_us,
            _frame(zones.frame),
            None if before is None else _frame(before),
            None if line is None else _line(line),
            zones.faults,
        )
    )


Last = tuple[Packed, Frame, Sheet]
"""A frame, packed and made."""


def unpack_frame(
    body: bytes, sheets: dict[int, Sheet], histories: Mapping[int, UnitHistory], last: Last | None = None
) -> tuple[Zones, Last]:
    """The frame, and what makes the next one sooner. Raises KeyError where its sheet is not known any more."""
    number, history, time_us, frame, before, line, faults = marshal.loads(body)
    sheet, made = sheets[number], None
    if last is not None and last[0] == before and last[2] is sheet:
        made = last[1]
    elif before is not None:
        made = _made(before, sheet)
    line = None if line is None else HostLine(*line)
    zones = Zones(_made(frame, sheet), sheet, time_us, made, line, faults or (STUCK,), histories.get(history))
    return zones, (frame, zones.frame, sheet)


def pack_run(run: Run, sheet: int, history: int) -> bytes:
    """A run of frames likewise."""
    return marshal.dumps(
        (
            sheet,
            history,
            run.packets.tobytes(),
            (run.starts - run.starts[0]).tobytes(),
            run.carried.tobytes(),
            run.records.shape[1],
            run.times_us.tobytes(),
            None if run.line is None else _line(run.line),
            None if run.before is None else _frame(run.before),
            run.faults,
        )
    )


def unpack_run(body: bytes, sheets: dict[int, Sheet], histories: Mapping[int, UnitHistory]) -> Run:
    """The run. Raises KeyError as :func:`unpack_frame`."""
    number, history, packets, starts, records, fields, times_us, line, before, faults = marshal.loads(body)
    sheet = sheets[number]
    return Run(
        sheet,
        np.frombuffer(packets, FIELDS),
        np.frombuffer(starts, np.int64),
        np.frombuffer(records, np.int64).reshape(-1, fields),
        np.frombuffer(times_us, np.int64),
        None if line is None else HostLine(*line),
        None if before is None else _made(before, sheet),
        faults,
        histories.get(history),
    )


def pack_error(error: ContactFPGAError, unreadable: bool) -> bytes:
    """An error that came in the place of a frame; ``unreadable``: no frame can be read now."""
    return pickle.dumps((error, unreadable))


def unpack_error(body: bytes) -> tuple[ContactFPGAError, bool]:
    """The same."""
    found: tuple[ContactFPGAError, bool] = pickle.loads(body)
    return found


def _line(line: HostLine) -> Packed:
    return line.arrived_s, line.base_us, line.base_s, line.rate, line.sigma_s


def _frame(frame: Frame) -> Packed:
    if frame.bitmap is not None:
        carried = np.packbits(frame.bitmap).tobytes()
    else:
        records = frame.moments if frame.barycenters is None else frame.barycenters
        carried = records.tobytes() if len(records) else b""
    return (
        frame.sequence,
        frame.time_us,
        _FLAG_WORDS[frame.flags],
        frame.overwritten,
        frame.heard,
        frame.zones,
        frame.cells,
        carried,
    )


def _made(packed: Packed, sheet: Sheet) -> Frame:
    sequence, time_us, flags, overwritten, heard, zones, cells, carried = packed
    bitmap = barycenters = None
    moments = nothing = no_records(sheet)
    if sheet.report == "cells":
        bits = np.unpackbits(np.frombuffer(carried, np.uint8), count=sheet.rows * sheet.columns)
        bitmap = bits.reshape(sheet.rows, sheet.columns).view(np.bool_)
    else:
        records = np.frombuffer(carried, np.int64).reshape(-1, nothing.shape[1]) if carried else nothing
        if sheet.report == "barycenter":
            barycenters = records
        else:
            moments = records
    return Frame(sequence, time_us, FLAG_SETS[flags], overwritten, heard, zones, cells, moments, bitmap, barycenters)
