"""Bytes of boards to which anything happens, some of them damaged on their way."""

from model_board import ModelBoard
from wire import old_frame

import contactfpga

SKINS = {
    "moments": contactfpga.Skin(),
    "barycenter": contactfpga.Skin(report="barycenter"),
    "odd": contactfpga.Skin(
        rows=5, columns=33, connectivity=4, zone_capacity=3, settle_us=50.0, surface="cylinder", radius_mm=70.0
    ),
    "large": contactfpga.Skin(rows=64, columns=64, connectivity=4, settle_us=50.0),  # a trailer of eight bytes
    "cells": contactfpga.Skin(rows=4, columns=5, report="cells"),
    "ghosts": contactfpga.Skin(diodes="none", rows=6, columns=6, connectivity=4),
}


def random_frame(board, rng):
    """A frame that a board may send, or one whose content cannot be."""
    skin = board.wire.skin
    if skin.report == "cells":
        return board.frame()
    most, zones, flags, options = skin.zone_capacity, [], [], {}
    for _ in range(rng.choice([0, 1, 1, 1, 2, 3])):
        area, x, y = rng.randrange(1, 5), rng.randrange(skin.columns), rng.randrange(skin.rows)
        scale = 16 if skin.report == "barycenter" else area
        zones.append((area, x * scale, y * scale))
    if rng.random() < 0.02:
        options["zones"] = rng.choice([len(zones) + 1, most + 1, 0])
    if rng.random() < 0.02:
        options["cells"] = rng.randrange(skin.rows * skin.columns + 1)
    if rng.random() < 0.02 and zones:
        far = 1 if skin.report == "barycenter" else (1 << board.wire.known.sum_x_bits) - 1
        zones[0] = (rng.choice([0, 3]), rng.choice([0, far]), 0)
    if rng.random() < 0.04:
        flags = rng.sample(["overflow", "mismatch", "fault"], rng.randrange(1, 4))
    if rng.random() < 0.02:  # more zones than it carries
        zones, flags = [zones[0] if zones else (1, 0, 0)] * most, ["overflow"]
        options |= {"zones": most + 1, "cells": min(sum(zone[0] for zone in zones) + 1, skin.rows * skin.columns)}
    if rng.random() < 0.02:  # more cells than the sheet has, or zones
        cells = skin.rows * skin.columns
        if rng.random() < 0.5:
            zones, options = [(cells - 1, 0, 0), (4, 0, 0)], {}
        else:
            zones, flags, options = [(1, 0, 0)] * most, ["overflow"], {"zones": skin.max_zones() + 1, "cells": cells}
    board.moments = zones
    return board.frame(flags, **options)


class History:
    """A board to which things happen."""

    def __init__(self, skin, rng):
        self.rng, self.skin = rng, skin
        self.board = ModelBoard(skin)
        self.first = self.board.hello()

    def more(self, count, asked=b""):
        """Bytes that it sends, in which it hears what is asked."""
        heard_at = self.rng.randrange(count)
        parts, self.first = [self.first], b""
        for place in range(count):
            if place == heard_at and any(hello for _, hello in self.board.hear(asked)):
                parts.append(self.board.hello())
            again = b"\0" * (self.rng.random() < 0.3)  # a second delimiter
            parts.append(random_frame(self.board, self.rng) + again if self.rng.random() < 0.98 else self.happening())
        return b"".join(damaged(part, self.rng) if self.rng.random() < 0.005 else part for part in parts)

    def happening(self):
        board, rng = self.board, self.rng
        match rng.randrange(8):
            case 0:
                return board.hello()
            case 1:
                board.heard = rng.randrange(8)
            case 2:
                board.time_us += rng.choice([1 << 20, 1 << 22, 1 << 23])
            case 3:
                board.sent += rng.choice([1, 3, 300])
            case 4:
                board.power_up()
                return board.hello() if rng.random() < 0.7 else b""
            case 5:
                return rng.choice([old_frame(), board.wire.seal(bytes([9, 9, 0x80])), b"\0\0", rng.randbytes(20)])
            case 6:  # another bitstream; perhaps of the same sheet
                other = rng.choice([{"pitch_x_mm": 3.0}, {"keep_alive_ms": 7.0}])
                self.board = ModelBoard(self.skin.replace(name="other", **other))
                return self.board.hello() if rng.random() < 0.8 else b""
            case 7:
                board.overwritten += rng.choice([1, 5, 13])
        return b""


def damaged(packet, rng):
    data = bytearray(packet)
    if not data:
        return b""
    place = rng.randrange(len(data))
    if rng.random() < 0.5:
        data[place] ^= 1 << rng.randrange(8)
    else:
        del data[place : place + rng.randrange(1, 40)]
    return bytes(data)
