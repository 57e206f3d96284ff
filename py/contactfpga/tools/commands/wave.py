"""The command `contactfpga wave`."""

from __future__ import annotations

import argparse
import time

from contactfpga.inputs.values import shell_words
from contactfpga.skin import Skin
from contactfpga.tools.console import flags, outputs, results

EXTRA = "sim"


def add_flags(flag: flags.Flags) -> None:
    flags.sheet(flag, "Skin of the board (default: the reference Skin).")
    pressed = "Press the first frame of this array of (frames, rows, columns) (default: 2x2 cells in the middle)."
    flag("--pressed FRAMES.npy", pressed)
    flags.output(flag, "File to write (default: touch.vcd).", default="touch.vcd")
    flags.json(flag)


def run(args: argparse.Namespace) -> int:
    from contactfpga_sim.model.scenes.recordings import Recording
    from contactfpga_sim.verify import wave

    file = flags.sheet_file(args)
    skin = Skin.load(file) if file else Skin()
    cells = Recording.load(args.pressed, None).pressed[0] if args.pressed else wave.finger(skin)
    vcd = outputs.file(args.output)
    started = time.monotonic()
    touch = wave.simulate(skin, cells, vcd)
    us = 1e6 / skin.clock_hz
    gtkw, surfer = wave.layouts(skin, vcd)
    touched_us, sent_us = (touch.touched - touch.begins) * us, (touch.ends - touch.begins) * us
    pressed = touch.zones.pressed
    rows = (
        ("waveform", f"{vcd}, {sent_us:,.1f} us of a sheet of {skin.rows}x{skin.columns}"),
        ("touched", f"at {touched_us:,.1f} us"),
        ("frame is sent", f"at {sent_us:,.1f} us, with {pressed} pressed cells"),
        ("golden model", f"the same in each of {touch.ends:,} clocks ({time.monotonic() - started:.0f} s)"),
        ("open it", shell_words("gtkwave", vcd, gtkw)),
        ("or", shell_words("surfer", vcd, "--command-file", surfer)),
    )
    times = {"touched_us": touched_us, "sent_us": sent_us, "clocks": touch.ends, "pressed": pressed}
    results.show(args, {"files": [vcd, gtkw, surfer]} | times, lambda: results.table(*rows))
    return 0
