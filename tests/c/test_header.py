"""The C header reads packets as the Python driver does, to the last counter, from whole and from corrupted streams."""

import dataclasses
import itertools
import random
import shutil
import struct
import subprocess
from pathlib import Path

import c_vectors
import numpy as np
import pytest
from c_compilers import COMPILERS, FOLDER, answers, program
from frames import moments, reaching
from model_board import ModelBoard
from sample import sample
from wire import FINGERPRINT, SHEET, digits, last_byte, old_frame, old_hello

from contactfpga import Skin
from contactfpga.driver.conversation import Conversation, frames_in
from contactfpga.skin.derived import LONGEST_PACKET
from contactfpga.wire.faults import Faults, SelfTestSlot
from contactfpga.wire.framing import SHORTEST_PACKET
from contactfpga.wire.hello import Hello
from contactfpga.wire.protocol import FLAGS, may_number
from contactfpga.wire.sheet_number import numbered, sheet_of, unnumbered
from contactfpga.wire.units import Sweep
from contactfpga.zones.run import Run
from contactfpga.zones.units import UnitSamples
from contactfpga.zones.zone import Zones
from contactfpga_sim.model.golden.uart import pulsed

SKINS = [
    Skin(),
    Skin(rows=1, columns=1, connectivity=4),
    Skin(rows=3, columns=5, report="cells", name="Zürich 7"),
    Skin(rows=7, columns=13, report="barycenter", barycenter_bits=3, send="on_change"),
    Skin(rows=64, columns=64, zone_capacity=5, settle_us=12.0, surface="cylinder", radius_mm=400.0),
    Skin(rows=16, columns=16, report="barycenter", connectivity=4, zone_capacity=3),
    Skin(rows=4, columns=9, report="cells", diodes="none"),
    Skin(rows=63, columns=64, settle_us=12.0, guard=True),
    Skin(rows=6, columns=7, connectivity=4, surface="cylinder", radius_mm=9.0, closed=True),
    Skin(rows=6, columns=5, guard=True, self_test=True, scan="reversal", precharge_us=0.25),
    Skin(rows=5, columns=4, units=3),
    Skin(rows=6, columns=7, extent=True),
    Skin(rows=5, columns=8, extent=True, report="barycenter", barycenter_bits=2, connectivity=4),
    Skin(rows=7, columns=5, extent=True, surface="cylinder", radius_mm=9.0, closed=True),
    Skin(rows=4, columns=7, report="cells", ruler=9, harder=(2,), guard=True, precharge_us=1.0, settle_us=40.0),
]


@pytest.fixture(scope="session", params=sample(COMPILERS, quick=["gcc"], slow=["clang", "gcc with the table"]))
def decoder(request, tmp_path_factory):
    """The example program, compiled."""
    command = COMPILERS[request.param]
    if not shutil.which(command[0]):
        pytest.skip(f"{command[0]} is not installed")
    program = tmp_path_factory.mktemp("c") / "decode"
    subprocess.run([*command, "-o", program, FOLDER / "decode.c"], check=True, timeout=250)
    return program


def by_c(decoder, data: bytes, *words: str) -> list[str]:
    done = subprocess.run([decoder, *words], input=data, capture_output=True, timeout=250, check=False)
    assert (done.returncode, done.stderr) == (0, b"")
    return done.stdout.decode().split("\n")[:-1]


def by_python(data: bytes) -> list[str]:
    talk = Conversation("recording", live=False)
    lines = []
    for piece in pieces(data):
        for event in talk.receive(piece, 0.0):
            if isinstance(event, Run):
                lines += map(frame_line, event)
            elif isinstance(event, Faults):
                lines.append(faults_line(event))
            elif isinstance(event, UnitSamples):
                lines.append(sweep_line(event, talk.units.history.last))
            elif isinstance(event, SelfTestSlot):
                pass  # the header has no use for these
            elif isinstance(event, Hello) or talk.hello is not None:  # that of another Skin comes as an error
                lines.append(hello_line(talk.hello))
                if talk.hello.units is not None:
                    lines.append(" ".join(map(str, ("units", *dataclasses.astuple(talk.hello.units)))))
    stats = talk.stats.to_dict()
    stats |= {reason: stats["damaged"].get(reason, 0) for reason in REASONS}
    lines = "\n".join(lines).split("\n") if lines else []  # a name may hold anything
    return [*lines, "stats " + " ".join(f"{name}={stats[name]}" for name in COUNTED)]


REASONS = ("framing", "crc", "length", "kind", "content", "noise")
COUNTED = (
    *("frames", "lost", "unexplained", "overwritten", *REASONS),
    *("sweeps", "sweeps_lost", "sweeps_unexplained", "resynchronized", "hellos", "fault_reports"),
    *("before_hello", "unknown_kinds", "foreign_version", "skin_changes", "restarts", "bytes"),
)


def pieces(data: bytes):
    """Packet by packet, and noise byte by byte where it is too long for one: only then it matters how bytes come."""
    for piece in data.split(b"\0")[:-1]:
        if len(piece) > LONGEST_PACKET:
            yield from (bytes([byte]) for byte in piece + b"\0")
        else:
            yield piece + b"\0"
    yield data.split(b"\0")[-1]


def hello_line(hello: Hello) -> str:
    sheet = hello.sheet
    report = ["moments", "cells", "barycenter"].index(sheet.report)
    return (
        f"hello {sheet.rows}x{sheet.columns} {sheet.connectivity}{'c' * sheet.closed}{'e' * sheet.extent} {report} "
        f"{sheet.barycenter_bits} "
        f"{int(hello.send == 'on_change')} {sheet.zone_capacity} {int(sheet.ghosts)} "
        f"{int(hello.guard)} {int(hello.self_test)} "
        f"{sheet.pitch_x_mm:.17g} {sheet.pitch_y_mm:.17g} {sheet.radius_mm or 0:.17g} {hello.fingerprint.hex()} "
        f"{hello.clock_hz} {hello.baud} {hello.sent} {hello.epoch} {hello.heard} {hello.stuck} "
        + hello.name.split("\0")[0]
    )


def sweep_line(samples: UnitSamples, sweep: Sweep) -> str:
    saturated = sum(1 << unit for unit, found in enumerate(samples.saturated) if found)
    facts = samples.time_us, sweep.sequence, int(sweep.over), int(sweep.armed), saturated
    return " ".join(map(str, ("sweep", *facts, *map(int, samples.readings))))


def faults_line(faults: Faults) -> str:
    words = [f"row:{row}" for row in faults.rows_open] + [f"column:{column}" for column in faults.columns_open]
    return " ".join(
        ["faults", *words, *(f"stuck:{column}" for column in faults.columns_stuck), *["joined"] * faults.joined]
    )


def frame_line(zones: Zones) -> str:
    frame = zones.frame
    flags = sum(1 << bit for bit, name in enumerate(FLAGS) if name in frame.flags)
    items = frame.moments if frame.barycenters is None else frame.barycenters
    items = items if frame.extents is None else np.concatenate([items, frame.extents], axis=1)
    words = [",".join(map(str, row)) for row in items.tolist()]
    if frame.bitmap is not None:
        reached = frame.bitmap * 1 if frame.levels is None else frame.levels
        words = [f"{row}:{column}" for row, column in np.argwhere(reached) for _ in range(reached[row, column])]
    fields = (frame.sequence, flags, frame.heard, frame.cells, frame.zones, frame.overwritten)
    return " ".join(map(str, ("frame", zones.time_us, *fields, *words)))


def zones(rng, skin) -> list:
    """Of zones that could be on the sheet; some of those with an extent could not."""
    if skin.extent:
        return reaching(rng, skin)
    count = rng.choice([0, 1, 1, 2, min(skin.zone_capacity, 7)])
    if skin.report == "barycenter":
        most = skin.barycenter_bits
        x, y = (lines - 1 << most for lines in (skin.columns, skin.rows))
        return [
            (rng.randint(1, 9), rng.randint(0, x), rng.randint(0, y)) for _ in range(min(count, skin.zone_capacity))
        ]
    left, found = skin.rows * skin.columns, []
    for row in moments(rng, skin, min(count, skin.zone_capacity)):
        if row[0] <= left:
            left -= row[0]
            found.append(row)
    return found


class History:
    """What a board may send in its life, and what becomes of it on the line."""

    def __init__(self, seed: int):
        self.rng = random.Random(seed)
        self.skin = self.rng.choice(SKINS)
        self.board = ModelBoard(self.skin)
        self.sweeps = 0
        self.numbers = itertools.cycle(number for number in range(129 * 128 + 1, 129 * 128 + 900) if may_number(number))

    def packet(self) -> bytes:
        rng, board = self.rng, self.board
        kind = rng.random()
        if kind < 0.08:
            return board.hello()
        if kind < 0.10:
            board.power_up()
            board.time_us = rng.randrange(1 << 23)
            return board.hello() if rng.random() < 0.8 else b""
        if kind < 0.11:
            self.skin = rng.choice(SKINS)
            self.board = ModelBoard(self.skin)
            return self.board.hello()
        if kind < 0.13:
            return old_hello() if rng.random() < 0.3 else old_frame()
        if kind < 0.15:
            return board.wire.seal(digits(rng.getrandbits(20), 4) + last_byte(rng.choice([8, 9, 10, 12, 15])))
        if kind < 0.17:
            board.time_us += rng.choice([1 << 20, 1 << 22, 1 << 23, 1 << 24, 1 << 25])
        if kind < 0.19:
            board.heard = next(self.numbers)
        if kind < 0.20:
            board.overwritten += rng.randrange(3)
        if kind < 0.21:
            return self.odd_hello()
        if kind < 0.215:
            return board.wire.seal(board.wire.trailer() + last_byte(rng.choice([5, 6, 7])))
        if kind < 0.45 and self.skin.units:
            return self.sweep()
        if kind < 0.30 and board.wire.known.fault_bits:
            return self.report()
        if kind < 0.22:
            return bytes(rng.randrange(1, 256) for _ in range(LONGEST_PACKET + rng.randrange(40))) + b"\0"
        board.moments = zones(rng, self.skin)
        options = {"flags": [flag for flag in ("fault", "mismatch", "motion") if rng.random() < 0.05]}
        if rng.random() < 0.03:
            options["cells"] = rng.randrange(self.skin.rows * self.skin.columns + 1)
        if rng.random() < 0.03 and self.skin.report != "cells":
            options["zones"] = rng.randrange(self.skin.max_zones() + 1)
            options["flags"] = ["overflow"] if rng.random() < 0.5 else []
        return board.frame(**options)

    def sweep(self) -> bytes:
        """Of the pressure units; some skip numbers, go back in time, or are none of this board."""
        rng, board = self.rng, self.board
        self.sweeps += rng.choice([1, 1, 1, 2, 7])
        time_us = board.time_us + rng.choice([-300, 10, 40, 90, 1 << 21])
        readings = [rng.choice([0, 1, 2047, 4094, 4095, rng.randrange(4096)]) for _ in range(self.skin.units)]
        if rng.random() < 0.1:
            change = rng.randrange(3)
            if change == 0:
                readings = readings[1:]
            elif change == 1:
                readings[0] = 4096 + rng.randrange(4096)
            else:
                return board.wire.seal(bytes(rng.randrange(1, 256) for _ in range(11)) + last_byte(8))
        return board.wire.sweep(readings, time_us, self.sweeps, rng.randrange(4))

    def report(self) -> bytes:
        """Of lines, or a slot of a self-test; some are none of this sheet."""
        rng, board, bits = self.rng, self.board, self.board.wire.known.fault_bits
        if rng.random() < 0.2:
            return board.wire.slot(
                rng.randrange(200), rng.getrandbits(self.skin.rows), rng.getrandbits(self.skin.columns)
            )
        if rng.random() < 0.6:
            board.word = rng.getrandbits(bits) & rng.getrandbits(bits) & rng.getrandbits(bits)
        if rng.random() < 0.9:
            return board.report()
        size = -(-bits // 7) + rng.choice([0, 0, 1])
        word = bytes(rng.randrange(1, 256) for _ in range(size))
        return board.wire.seal(word + bytes([9 << 4 | rng.randrange(2)]))

    def odd_hello(self) -> bytes:
        """In two packets, with a field that nobody knows, one too short, one missing or one of odd content."""
        board, rng = self.board, self.rng
        fields = board.wire.hello_fields(sent=board.sent, epoch=board.time_us // 2**22)
        place = rng.randrange(len(fields))
        change = rng.randrange(4)
        if change == 0:
            return board.wire.seal_bare(fields[:place]) + board.wire.seal_bare(fields[place:])
        if change == 1:
            return board.wire.seal_bare(fields[:place] + fields[place + 1 :])
        if change == 2:
            return board.wire.seal_bare([*fields[:place], fields[place][:-1], *fields[place + 1 :]])
        facts = board.wire.facts()
        kind = rng.choice(list(facts))
        facts[kind] = bytes(rng.randrange(256) if rng.random() < 0.2 else byte for byte in facts[kind])
        if rng.random() < 0.5:
            facts |= {rng.choice([7, 9, 200]): bytes(rng.randrange(256) for _ in range(rng.randrange(5)))}
        return board.wire.hello(sent=board.sent, epoch=board.time_us // 2**22, facts=facts)

    def line(self, data: bytes) -> bytes:
        """What arrives of it."""
        rng = self.rng
        luck = rng.random()
        if luck > 0.12 or not data:
            return data
        if luck > 0.08:
            return b""
        if luck > 0.06:
            return data[: rng.randrange(len(data))]
        if luck > 0.04:
            return data + data
        if luck > 0.02:
            return bytes(rng.randrange(256) for _ in range(rng.randrange(30))) + data
        place = rng.randrange(len(data))
        return data[:place] + bytes([data[place] ^ 1 << rng.randrange(8)]) + data[place + 1 :]

    def stream(self, packets: int) -> bytes:
        first = self.board.hello() if self.rng.random() < 0.8 else b"\x07\x00"
        return first + b"".join(self.line(self.packet()) for _ in range(packets))


@pytest.mark.parametrize("seed", sample(range(40), quick=range(6)))
def test_c_and_python_agree_on_random_histories(decoder, seed):
    data = History(seed).stream(300)
    assert by_c(decoder, data) == by_python(data)


@pytest.mark.parametrize("skin", SKINS, ids=lambda skin: f"{skin.rows}x{skin.columns}-{skin.report}")
def test_c_and_python_agree_on_every_flipped_bit(decoder, skin):
    """Of a hello and a frame; whole packets are before and after them."""
    board = ModelBoard(skin)
    board.moments = zones(random.Random(1), skin)
    head, hello, frame, tail = board.hello(), board.hello(), board.frame(), board.frame() + board.hello()
    data = b""
    for packet in (hello, frame):
        flips = list(range(8 * len(packet)))
        for bit in flips if len(packet) < 120 else random.Random(2).sample(flips, 400):
            flipped = bytearray(packet)
            flipped[bit // 8] ^= 1 << bit % 8
            data += head + bytes(flipped) + tail
    assert by_c(decoder, data) == by_python(data)


@pytest.mark.parametrize("word", ["", "x", "1x", "-1", "16"])
def test_what_is_no_number_of_a_sheet_is_refused(decoder, word):
    done = subprocess.run([decoder, word], input=b"", capture_output=True, timeout=250, check=False)
    assert done.returncode == 2
    assert f"the sheet is '{word}'; it must be a number from 0 to 15" in done.stderr.decode()


@pytest.mark.parametrize("number", [0, 1, 15])
def test_packets_of_one_sheet_are_sorted_from_those_of_all(decoder, rng, number):
    """The driver numbers and sorts the packets of two sheets on a line, with faults and flipped bits."""
    sheets = {one: History(one) for one in (number, 7)}
    line, own = b"", b""
    for _ in range(200):
        of = rng.choice(list(sheets))
        for packet in sheets[of].packet().split(b"\0"):
            if SHORTEST_PACKET <= len(packet) < LONGEST_PACKET:
                sent = bytearray(numbered(packet, of))
                if rng.random() < 0.1 and sent[place := rng.randrange(len(sent))] != (flip := 1 << rng.randrange(8)):
                    sent[place] ^= flip
                line += bytes(sent) + b"\0"
                own += unnumbered(bytes(sent)) + b"\0" if sheet_of(bytes(sent)) == number else b""
    said = by_c(decoder, line, str(number))
    assert said == by_c(decoder, own)
    assert sum(one.startswith("frame") for one in said) > 10


@pytest.mark.parametrize(
    ("field", "value", "taken"),
    [
        (9, struct.pack("<BBBBHI", 3, 28, 4, 38, 5, 700), True),
        (9, struct.pack("<BBBBHI", 3, 12, 4, 39, 5, 700), False),
        (9, struct.pack("<BBBBHI", 3, 12, 4, 128, 5, 700), False),
        (9, struct.pack("<BBBBHI", 3, 29, 4, 0, 5, 700), False),
        (10, bytes([0, 2]), True),
        (10, bytes([1, 2]), True),
        (10, bytes([2, 2]), False),
        (10, bytes([0, 0]), False),
        (10, bytes([1]), False),
    ],
)
def test_a_hello_that_cannot_be_is_refused_alike(decoder, field, value, taken):
    board = ModelBoard(Skin(rows=5, columns=4, units=3))
    data = board.wire.hello(facts=board.wire.facts() | {field: value})
    said = by_c(decoder, data)
    assert said == by_python(data)
    assert (said[0].split()[0] == "hello") == taken


ROUND = Skin(rows=6, columns=7, surface="cylinder", radius_mm=9.0, closed=True)
CHANGES = {
    Skin(): [{"rows": 15}, {"columns": 15}, {"connectivity": 4}, {"report": "cells"}, {"zone_capacity": 9}],
    Skin(clock_hz=24_000_000): [{"pitch_x_mm": 9.0}, {"pitch_y_mm": 9.0}, {"surface": "cylinder", "radius_mm": 99.0}],
    Skin(report="barycenter", barycenter_bits=3): [{"barycenter_bits": 4}],
    Skin(report="cells"): [{"diodes": "none"}],
    Skin(report="cells", ruler=16, harder=(4,), guard=True, precharge_us=1.0): [{"harder": (4, 1)}],
    ROUND: [{"radius_mm": 8.0}, {}],  # with {} its ends do not meet, which no Skin of this pitch allows
}


@pytest.mark.parametrize(("skin", "changed"), [(skin, one) for skin, found in CHANGES.items() for one in found])
def test_a_sheet_that_is_another_by_one_field_is_a_change(decoder, skin, changed):
    """A hello with one other field is another Skin, even if its fingerprint is the same: times and counts restart."""
    wire = ModelBoard(skin).wire
    other = ModelBoard(skin.replace(**changed)).wire.facts() | {FINGERPRINT: wire.known.fingerprint}
    if not changed:
        other[SHEET] = other[SHEET][:2] + bytes([skin.connectivity]) + other[SHEET][3:]
    data = wire.hello(sent=100_000) + wire.hello(sent=5, facts=other)
    said = by_c(decoder, data)
    assert said == by_python(data)
    assert " skin_changes=1 restarts=0 " in said[-1]


@pytest.mark.parametrize(("lost", "known"), [(0, 3), (1, 1)])
def test_a_board_that_heard_no_request_and_lost_frames_is_not_known_when_its_time_begins_at_0(decoder, lost, known):
    """A lost frame at the wrap of the time looks like a restart."""
    board = ModelBoard(Skin())
    board.sent, board.time_us = 100, 2**24 - 100
    data = board.hello() + board.frame()
    board.sent += lost
    board.time_us += 96
    data += board.frame() + board.frame()
    said = by_c(decoder, data)
    assert said == by_python(data)
    assert sum(line.startswith("frame ") for line in said) == known


def test_a_loss_of_more_than_32_bits_is_counted(decoder):
    wire = ModelBoard(Skin()).wire
    data = wire.hello(sent=1) + wire.hello(sent=2**40)
    said = by_c(decoder, data)
    assert said == by_python(data)
    assert f" lost={2**40 - 1} " in said[-1]


def test_the_histories_hold_all_that_is_counted():
    """Otherwise the comparison would say nothing of it."""
    seen = set()
    for seed in range(12):
        *_, stats = by_python(History(seed).stream(300))
        seen |= {name for name, count in (word.split("=") for word in stats.split()[1:]) if int(count)}
    assert seen == set(COUNTED)


def test_the_pages_examples_compile(tmp_path):
    page = (FOLDER.parent / "docs" / "c.md").read_text(encoding="utf-8")
    first, *more = page.split("```c\n")[1:]
    assert more
    for example in (first, *more):
        (tmp_path / "example.c").write_text(example.split("```")[0])
        command = [*COMPILERS["gcc"], "-Wno-unused-but-set-variable", f"-I{FOLDER}", "-c", "-o", tmp_path / "example.o"]
        subprocess.run([*command, tmp_path / "example.c"], check=True, timeout=250)


def test_a_smaller_reader_refuses_what_is_too_long_and_reads_the_rest(tmp_path):
    program = tmp_path / "small"
    source = FOLDER / "decode.c"
    subprocess.run(
        [*COMPILERS["gcc"], "-DCONTACTFPGA_PACKET_BYTES=120", "-o", program, source], check=True, timeout=250
    )
    board = ModelBoard(Skin())
    hello = board.hello()
    board.moments = [(1, column, row) for row in range(0, 16, 2) for column in range(0, 16, 2)]
    long = board.frame()
    assert len(long) > 120
    board.moments = board.moments[:3]
    lines = by_c(program, hello + long + board.frame() + board.frame())
    assert [line.split()[0] for line in lines] == ["hello", "frame", "frame", "stats"]
    assert "noise=2" in lines[-1]
    assert "lost=1" in lines[-1]


def compiled_mm(folder: Path) -> Path:
    """A program that writes the place of each zone in mm."""
    code = r"""
#include <stdio.h>
#include "contactfpga.h"
static contactfpga_reader reader;
int main(void) {
    int byte;
    contactfpga_init(&reader);
    while ((byte = getchar()) != EOF)
        if (contactfpga_push(&reader, (uint8_t)byte) == CONTACTFPGA_FRAME) {
            contactfpga_zone zone;
            double x_mm, y_mm;
            for (uint16_t i = 0; contactfpga_zone_at(&reader, i, &zone); i++) {
                contactfpga_barycenter_mm(&reader, &zone, &x_mm, &y_mm);
                printf("%.17g %.17g\n", x_mm, y_mm);
            }
        }
    return 0;
}
"""
    return program(folder, code)


def test_barycenters_in_mm(tmp_path):
    mm = compiled_mm(tmp_path)
    for skin in (Skin(pitch_x_mm=9.5), Skin(report="barycenter", pitch_y_mm=3.25)):
        board = ModelBoard(skin)
        board.moments = [(3, 40, 7), (4, 10, 6)]
        data = board.hello() + board.frame()
        (frame,) = frames_in(Conversation("", live=False).receive(data, 0.0))
        found = {tuple(map(float, line.split())) for line in by_c(mm, data)}
        assert found == {(zone.x_mm, zone.y_mm) for zone in frame}


def test_a_zone_over_the_seam_has_a_place_and_a_ring_has_none(tmp_path):
    board = ModelBoard(Skin(rows=5, columns=7, surface="cylinder", radius_mm=30.0, closed=True))
    board.moments = [(3, 12, 7, 2), (7, 21, 7, 7), (4, 10, 6, 63)]
    data = board.hello() + board.frame()
    (frame,) = frames_in(Conversation("", live=False).receive(data, 0.0))
    assert {zone.winding for zone in frame} == {"", "ring", "wound"}
    mm = compiled_mm(tmp_path)
    wanted = [f"{'nan' if zone.x_mm is None else repr(zone.x_mm)} {zone.y_mm!r}" for zone in frame]
    found = [" ".join(repr(abs(float(word))) for word in line.split()) for line in by_c(mm, data)]
    assert sorted(found) == sorted(wanted)


def test_a_zone_without_cells_has_no_place(tmp_path):
    """Which a frame flagged mismatch may hold."""
    mm = compiled_mm(tmp_path)
    around = Skin(rows=5, columns=7, surface="cylinder", radius_mm=30.0, closed=True)
    for skin, record in ((around, (0, 0, 0, 0)), (around, (0, 9, 3, 2)), (Skin(), (0, 9, 3))):
        board = ModelBoard(skin)
        board.moments = [record]
        data = board.hello() + board.frame(cells=3, flags=["mismatch"])
        assert [line.replace("-", "") for line in by_c(mm, data)] == ["nan nan"]


def test_a_board_of_few_clocks_per_bit_takes_pulses(tmp_path):
    code = """
#include <stdio.h>
#include "contactfpga.h"
int main(void) {
    static contactfpga_hello hello;
    unsigned long clock_hz, baud;
    while (scanf("%lu %lu", &clock_hz, &baud) == 2) {
        hello.clock_hz = (uint32_t)clock_hz, hello.baud = (uint32_t)baud;
        printf("%d\\n", contactfpga_pulsed(&hello));
    }
    return 0;
}
"""
    rates = [(24_000_000, 12_000_000), (60_000_000, 12_000_000), (12_000_000, 3_000_000), (42_000_000, 12_000_000)]
    lines = "".join(f"{clock_hz} {baud}\n" for clock_hz, baud in rates)
    assert [word == "1" for word in answers(program(tmp_path, code), lines)] == [
        pulsed(round(clock_hz / baud)) for clock_hz, baud in rates
    ]


def test_vectors_are_those_of_the_golden_encoder():
    assert c_vectors.PATH.read_text(encoding="utf-8") == c_vectors.text()


def test_vectors_by_c_and_by_python(decoder):
    *streams, _ = c_vectors.text().split("\n# ")[2:]
    assert len(streams) == len(c_vectors.SKINS)
    for stream in streams:
        lines = stream.splitlines()[1:]
        data = b"".join(bytes.fromhex(line[2:]) for line in lines if line.startswith("> "))
        said = [line for line in lines if line and not line.startswith("> ")]
        assert by_c(decoder, data)[:-1] == said
        assert by_python(data)[:-1] == said


FUZZ = r"""
#include "contactfpga.h"
static contactfpga_reader reader;
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    contactfpga_init(&reader);
    for (size_t i = 0; i < size; i++) {
        contactfpga_event event = contactfpga_push(&reader, data[i]);
        for (unsigned what = 0; event == CONTACTFPGA_HELLO && what < 8; what++) {
            uint32_t value;
            contactfpga_unit_value(&reader.hello, (uint8_t)what, 0, UINT32_MAX, &value);
        }
        if (event != CONTACTFPGA_FRAME) continue;
        contactfpga_zone zone;
        for (uint16_t n = 0; contactfpga_zone_at(&reader, n, &zone); n++)
            if (!zone.area && !(reader.frame.flags & CONTACTFPGA_MISMATCH)) __builtin_trap();
        for (unsigned row = 0; row < 256; row++) contactfpga_pressed(&reader, (uint8_t)row, (uint8_t)(row * 7));
    }
    return 0;
}
"""


@pytest.mark.campaign
def test_a_minute_of_coverage_guided_bytes(tmp_path):
    """Sanitizers stop at the first access outside the reader, and a trap at a zone without cells."""
    if not shutil.which("clang"):
        pytest.skip("clang is not installed")
    (tmp_path / "fuzz.c").write_text(FUZZ)
    command = ["clang", "-g", "-O1", "-fsanitize=fuzzer,address,undefined", f"-I{FOLDER}", "-o", tmp_path / "fuzz"]
    built = subprocess.run([*command, tmp_path / "fuzz.c"], capture_output=True, text=True, timeout=250, check=False)
    if "libclang_rt.fuzzer" in built.stderr:
        pytest.skip("clang has no libFuzzer")
    assert built.returncode == 0, built.stderr
    seeds = tmp_path / "seeds"
    seeds.mkdir()
    for seed in range(20):
        (seeds / str(seed)).write_bytes(History(seed).stream(30))
    run = [tmp_path / "fuzz", "-max_total_time=60", "-max_len=20000", seeds]
    done = subprocess.run(run, capture_output=True, text=True, timeout=180, check=False)
    assert done.returncode == 0, done.stderr[-3000:]
