"""Random Skins that can be built, each with a switch."""

import random

from contactfpga import Skin
from contactfpga.design.sheet import SheetError, lay_out


def drawn(seed):
    """A random Skin that can be built, and a switch."""
    dice = random.Random(seed)
    rows, columns, closed = dice.randint(1, 24), dice.randint(1, 24), dice.random() < 0.3
    values = {
        "rows": rows,
        "columns": max(columns, 8) if closed else columns,
        "pitch_x_mm": round(dice.uniform(5.6, 14), 3),
        "pitch_y_mm": round(dice.uniform(5.6, 14), 3),
        "guard": dice.random() < 0.5,
        "diodes": dice.choice(["col2row", "row2col"]),
        "mask": tuple((r, c) for r in range(rows) for c in range(columns) if dice.random() < dice.choice([0, 0.1])),
        "row_order": tuple(dice.sample(range(rows), rows)),
    }
    if closed:
        values |= {
            "closed": True,
            "surface": "cylinder",
            "radius_mm": round(values["columns"] * dice.uniform(1.2, 2.5), 3),
        }
        del values["pitch_x_mm"]
    if dice.random() < 0.3:
        values |= {"scan": "reversal", "precharge_us": 0.25}
    else:
        values |= {"row_drive": dice.choice(["direct", "74hc595"]), "column_read": dice.choice(["direct", "74hc165"])}
        values["row_chains"] = dice.randint(1, 2) if values["row_drive"] != "direct" and rows > 3 else 1
    return Skin(**values), dice.choice(["dome", "tact"])


def refused(skin, part):
    """Why a sheet is refused; nothing for one that is laid out."""
    try:
        lay_out(skin, part=part)
    except SheetError as error:
        return str(error)
    return ""
