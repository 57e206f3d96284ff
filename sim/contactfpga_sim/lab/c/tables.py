"""Bytes that the C header needs on microcontrollers."""

from __future__ import annotations

import shutil
import subprocess
import tempfile
from pathlib import Path

from contactfpga.errors import MissingTool
from contactfpga.skin import Skin
from contactfpga.skin.derived import LONGEST_PACKET, Widths
from contactfpga_sim.lab import writer

COMPILER = "arm-none-eabi-gcc"
CORES = {"Cortex-M0+": ["-mcpu=cortex-m0plus"], "Cortex-M4": ["-mcpu=cortex-m4"], "Cortex-M7": ["-mcpu=cortex-m7"]}
SHEETS = {
    "16x16, at most 8 zones": Widths(Skin(zone_capacity=8).sheet).max_frame_bytes,
    "16x16": Widths(Skin().sheet).max_frame_bytes,
    "any sheet": LONGEST_PACKET,
}
HELLO_BYTES = 120
"""Longest hello of today's boards, with a name of 32 bytes."""

USES = {
    "read zones and pressure units": """
contactfpga_reader reader;
void begin(void) { contactfpga_init(&reader); }
int take(uint8_t byte) { return contactfpga_push(&reader, byte); }
int zone(uint16_t index, contactfpga_zone *out) { return contactfpga_zone_at(&reader, index, out); }
""",
    "and ask for frames": """
size_t ask(uint32_t number, uint8_t *out) { return contactfpga_request(number, false, false, out); }
""",
    "and set zeros and thresholds of units": """
size_t tell(uint32_t number, uint8_t what, uint8_t unit, uint32_t steps, uint8_t *out) {
    uint32_t value;
    if (!contactfpga_unit_value(&reader.hello, what, unit, steps, &value)) return 0;
    return contactfpga_command(number, what, value, false, false, out);
}
""",
}


def sizes_table() -> str:
    uses = ["".join(list(USES.values())[: count + 1]) for count in range(len(USES))]
    rows = [["bytes of code (`-Os`)", *CORES]]
    for name, code in zip(USES, uses, strict=True):
        rows.append([name, *(f"{size(code, flags, HELLO_BYTES)[0]:,}" for flags in CORES.values())])
    memory = [["longest packet of", "`CONTACTFPGA_PACKET_BYTES`", "bytes of RAM"]]
    for name, longest in SHEETS.items():
        packet = max(longest, HELLO_BYTES)
        memory.append([name, f"{packet:,}", f"{size(uses[0], CORES['Cortex-M4'], packet)[1]:,}"])
    return f"{writer.table_of(rows)}\n\n{writer.table_of(memory)}"


def size(code: str, flags: list[str], packet: int) -> tuple[int, int]:
    if not shutil.which(COMPILER):
        raise MissingTool("measuring code for microcontrollers", COMPILER, "apt install gcc-arm-none-eabi")
    with tempfile.TemporaryDirectory() as folder:
        source, built = Path(folder, "use.c"), Path(folder, "use.o")
        source.write_text(f'#include "contactfpga.h"\n{code}')
        options = ["-std=c99", "-Os", "-mthumb", f"-DCONTACTFPGA_PACKET_BYTES={packet}", "-Ic", *flags]
        subprocess.run([COMPILER, *options, "-c", "-o", built, source], check=True)
        told = subprocess.run(["arm-none-eabi-size", built], check=True, capture_output=True, text=True).stdout
    text, initialized, zeroed = map(int, told.splitlines()[1].split()[:3])
    return text + initialized, initialized + zeroed
