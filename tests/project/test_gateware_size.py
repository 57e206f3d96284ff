"""How much of the gateware a reader has to hold: what is loaded for a Skin is what its board consists of."""

import json
import subprocess
import sys
from pathlib import Path

MOST_MODULES, MOST_LINES = 25, 2910
LOADED = """
import json, sys
from amaranth.back import rtlil
from contactfpga.skin import Skin
from contactfpga_hdl.top import Top
rtlil.convert(Top(Skin({options})))
loaded = {{name: module.__file__ for name, module in sys.modules.items() if name.startswith("contactfpga_hdl")}}
print(json.dumps(loaded))
"""


def loaded(options=""):
    """Files of the gateware's modules that are loaded when a Skin's is made, by name."""
    done = subprocess.run(
        [sys.executable, "-c", LOADED.format(options=options)], capture_output=True, text=True, check=True
    )
    return {name.removeprefix("contactfpga_hdl."): Path(file) for name, file in json.loads(done.stdout).items()}


def test_a_default_skin_s_gateware_is_read_in_an_afternoon():
    files = loaded()
    lines = sum(len(file.read_text(encoding="utf-8").splitlines()) for file in files.values())
    assert len(files) <= MOST_MODULES, sorted(files)
    assert lines <= MOST_LINES


def test_a_part_is_loaded_for_the_skins_that_have_it():
    assert loaded("guard=True, fail_safe=True, alive=True").keys() - loaded().keys() == {
        "scan.guard",
        "link.other_packets",
        "link.faults",
        "link.alive",
    }
