"""The thread in C that reads ports: under sanitizers, and packet by packet against the decoder in Python."""

import itertools
import random
import shutil
import subprocess
from pathlib import Path

import pytest
from c_compilers import FOLDER, WARNINGS
from frames import reaching
from hypothesis import given, settings
from hypothesis import strategies as st
from model_board import ModelBoard
from sample import sample

from contactfpga import Skin
from contactfpga.driver import native
from contactfpga.skin.derived import Widths
from contactfpga.wire import framing, protocol
from contactfpga.wire.framing import PacketError
from contactfpga.wire.protocol import frame_of

STRESS = Path(__file__).with_name("reader_stress.c")
OPTIONS = ["-std=c99", "-ffp-contract=off", "-pthread", f"-I{FOLDER}"]


def compiled(compiler, program, *options):
    if not shutil.which(compiler):
        pytest.skip(f"{compiler} is not installed")
    command = [compiler, *OPTIONS, *options, STRESS, "-lm", "-o", program]
    return subprocess.run(command, capture_output=True, text=True, timeout=250, check=False)


@pytest.mark.parametrize("compiler", sample(["gcc", "clang"], quick=["gcc"], slow=["clang"]))
def test_it_compiles_without_a_warning(compiler, tmp_path):
    warnings = [option for option in WARNINGS if option != "-Wconversion"]
    done = compiled(compiler, tmp_path / "reader", *warnings)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize(
    ("sanitizer", "count"),
    sample(
        [("address,undefined", 100_000), ("thread", 100_000), ("address,undefined", 5_000_000), ("thread", 2_000_000)],
        quick=[("address,undefined", 100_000)],
        slow=[("thread", 100_000)],
    ),
)
def test_threads_that_read_take_wait_and_close_disturb_nobody(sanitizer, count, tmp_path):
    """A sanitizer sees no access out of bounds or after the end, no overflow and no race; every byte is taken once."""
    built = compiled("gcc", tmp_path / "stress", "-g", "-O1", f"-fsanitize={sanitizer}", "-fno-sanitize-recover=all")
    if built.returncode and ("lasan" in built.stderr or "ltsan" in built.stderr or "lubsan" in built.stderr):
        pytest.skip(f"gcc has no sanitizer for {sanitizer}")
    assert built.returncode == 0, built.stderr
    done = subprocess.run([tmp_path / "stress", str(count)], capture_output=True, text=True, timeout=280, check=False)
    assert done.returncode == 0, done.stderr[-3000:]
    assert done.stdout.startswith(f"{count} bytes, ")


SKINS = [
    Skin(),
    Skin(rows=64, columns=64, settle_us=12.0),
    Skin(report="barycenter", barycenter_bits=4),
    Skin(rows=7, columns=13, connectivity=4, zone_capacity=3),
    Skin(rows=6, columns=7, connectivity=4, surface="cylinder", radius_mm=9.0, closed=True),
    Skin(rows=6, columns=7, extent=True),
    Skin(rows=6, columns=7, extent=True, report="barycenter"),
    Skin(rows=6, columns=7, extent=True, surface="cylinder", radius_mm=9.0, closed=True),
]


def by_python(packet, widths, before):
    """Fields and records of a whole frame, else None."""
    try:
        return fields(protocol.decode_frame(framing.unseal(packet, before), widths))
    except PacketError:
        return None


def by_c(table, skin):
    """The same of each packet."""
    records = [table.records[start:end] for start, end in itertools.pairwise(table.starts)]
    return [
        fields(frame_of(row.item(), found, skin.sheet)) if row["valid"] else None
        for row, found in zip(table.packets, records, strict=True)
    ]


def fields(frame):
    records = frame.moments if frame.barycenters is None else frame.barycenters
    plain = (
        frame.sequence,
        frame.time_us,
        sorted(frame.flags),
        frame.overwritten,
        frame.heard,
        frame.zones,
        frame.cells,
    )
    return *plain, records.tolist(), None if frame.extents is None else frame.extents.tolist()


@st.composite
def streams(draw):
    """Packets of a board, whole, damaged, cut and mingled with noise, and where reads end."""
    skin = draw(st.sampled_from(SKINS))
    board, data = ModelBoard(skin), b""
    sizes = st.lists(st.tuples(*[st.integers(1, 12)] * 3), max_size=4)
    for _ in range(draw(st.integers(1, 12))):
        if skin.extent:
            board.moments = reaching(random.Random(draw(st.integers(0, 1 << 32))), skin)
        elif skin.report != "barycenter" and not skin.sheet.closed:
            board.moments = [
                (area, min(x * area, (skin.columns - 1) * area), min(y * area, (skin.rows - 1) * area))
                for area, x, y in draw(sizes)
            ][: skin.zone_capacity]
        packet = bytearray(board.frame() if draw(st.integers(0, 9)) else board.hello())
        match draw(st.integers(0, 5)):
            case 0:
                packet[draw(st.integers(0, len(packet) - 1))] ^= 1 << draw(st.integers(0, 7))
            case 1:
                del packet[draw(st.integers(0, len(packet) - 1)) :]
            case 2:
                packet += draw(st.binary(max_size=30))
        data += bytes(packet)
    return skin, data, draw(st.lists(st.integers(0, len(data)), max_size=8))


@pytest.mark.skipif(bool(native.missing()), reason=native.missing())
@settings(max_examples=150)
@given(streams())
def test_it_decodes_what_python_decodes_wherever_reads_end(stream):
    skin, data, cuts = stream
    widths, before = Widths(skin.sheet), protocol.check_prefix(skin)
    port = native.Port(-1, 0.0)
    port.decode((widths, before))
    found, came, sizes = [], b"", []
    for start, end in zip([0, *sorted(cuts)], [*sorted(cuts), len(data)], strict=True):
        port.feed(data[start:end], 0.0)
        if start % 2 and end < len(data):
            continue  # so that some are taken together
        reads, begun, missing = port.take()
        assert (begun, missing) == (b"", 0)
        came += b"".join(reads.data_of(at) for at in range(len(reads)))
        found += by_c(reads.table, skin)
        sizes += reads.sizes.tolist()
    packets = [packet for packet in data.split(b"\0")[:-1] if packet]
    assert came == data
    assert sizes == list(map(len, packets))
    assert found == [by_python(packet, widths, before) for packet in packets]
    assert by_c(native.decode(packets, widths, before), skin) == found
