"""Small boards that hold real time on a busy machine: one for several tests, as each has to be compiled."""

from contactfpga.skin import Skin

SLOW = Skin(rows=4, columns=4, clock_hz=3_000_000, baud=750_000, settle_us=100.0)
SHEETS = [
    SLOW.replace(name=name, columns=columns, row_drive="74hc595", column_read="74hc165")
    for name, columns in (("chest", 4), ("back", 5))
]
"""Of one FPGA."""


def two_sheets(folder):
    """The file of these sheets, written into a folder."""
    for skin in SHEETS:
        (folder / f"{skin.name}.toml").write_text(skin.to_toml())
    file = folder / "sheets.toml"
    file.write_text(f"sheets = {[f'{skin.name}.toml' for skin in SHEETS]}\n".replace("'", '"'))
    return file
