"""Requests as pulses, on lines of 2 and 3 clocks per bit, and what else comes there."""

import itertools

import pytest
from listener import IDLE, Listener, give_bits
from wire import line

from contactfpga.wire import framing, protocol
from contactfpga_hdl.link.pulses import PulseReceiver
from contactfpga_hdl.link.request import RequestReader
from contactfpga_sim.model.golden.request import command, heard, pulses, request

BITS = (2, 3)
ONE, MARK, ZERO = 0xFF, 0xF0, 0x00


@pytest.fixture(scope="module", params=BITS)
def listen(bench, request):
    """Requests (cycle, number, hello) in levels that begin in cycle ``IDLE``, and the number in each cycle."""
    dut = Listener(PulseReceiver(request.param))
    sim = bench(dut)

    def listen(levels):
        return dut.listen(sim, levels)

    listen.bit = request.param
    return listen


def sampled(data, bit, phase, jitter, rng):
    """Levels at whole clocks of bytes whose bits take ``bit`` clocks, each edge moved by up to ``jitter`` clocks."""
    edges, level = [], 1
    for place, now in enumerate(line(data, 1)):
        if now != level:
            edges.append(phase + place * bit + rng.uniform(-jitter, jitter))
            level = now
    levels, level, clock = [], 1, 0
    for edge in edges:
        while clock < edge:
            levels.append(level)
            clock += 1
        level ^= 1
    return [*levels, 1]


def test_the_encoder_and_the_models_agree():
    assert pulses(b"\0\x01\xfe") == bytes([MARK, ONE, *[ZERO] * 7, ZERO, *[ONE] * 7])
    for number, hello in ((0x15A2D1, False), (0x4081, True)):
        data = protocol.encode_request(number, hello, pulsed=True)
        assert data == request(number, hello, 2) == request(number, hello, 3)
        assert len(data) == 2 + 64
    assert all(framing.pulses(bytes([value])) == pulses(bytes([value])) for value in range(256))


@pytest.mark.parametrize("error", [-0.02, 0.0, 0.02])
def test_requests_are_taken_at_any_phase_with_jitter_and_clock_error(listen, rng, error):
    """Each edge of a request is moved by up to 0.22 bits. The limit is a one of 2 clocks, which must be seen, as must
    the line's rest between two bytes."""
    phases = 8
    for turn in range(phases):
        number, hello = rng.randrange(1, 1 << 21), rng.random() < 0.5
        data = request(number, hello, listen.bit)
        found, _ = listen(sampled(data, listen.bit * (1 + error), turn / phases, 0.22 * listen.bit, rng))
        assert [(got, asks) for _, got, asks in found] == [(number, hello)]


def test_any_bytes_are_read_as_the_golden_model_does(listen, rng):
    """Requests, parts of some, bytes as other boards take them, any pulses and any bytes: each clock's number."""
    total = 0
    for _ in range(4):
        data = b""
        for _ in range(8):
            whole = request(rng.randrange(1, 1 << 21), rng.random() < 0.5, rng.choice([listen.bit, listen.bit, 4]))
            some = bytes(rng.choice([ONE, ZERO, ZERO, MARK]) for _ in range(rng.randrange(20)))
            data += rng.choice([whole, whole, whole[: rng.randrange(len(whole))], some, rng.randbytes(6)])
        found, numbers = listen(line(data, listen.bit))
        expected = heard([(IDLE, data)], listen.bit)
        assert found == [(one.cycle, one.number, one.hello) for one in expected.requests]
        assert numbers == [expected.number(cycle) for cycle in range(len(numbers))]
        total += len(found)
    assert total > 2


@pytest.fixture(scope="module")
def read(bench):
    """Requests (number, hello) among pulses, as fast as a receiver can tell them; what that makes of the line is
    proved."""
    dut = RequestReader()
    sim = bench(dut)

    def read(symbols):
        events, bits = [], 0  # level, bit, index, good, bad
        for symbol in symbols:
            if symbol == MARK:
                events += [(0, 0, 0, 0, 1)] * (bits > 0) + [(0, 0, 0, 1, 0)]
                bits = 0
                continue
            events.append((int(symbol == ONE), 1, bits, 0, 0))
            bits = (bits + 1) % 8
            if not bits:
                events.append((0, 0, 0, 1, 0))
        cycles = give_bits(sim, dut.bits, events)
        received, hello, number = sim.watch(dut.received), sim.watch(dut.hello), sim.watch(dut.number)
        sim.run(cycles)
        return [(number[at + 1], bool(hello[at])) for at, taken in enumerate(received.values) if taken]

    return read


SENT = (0x12345 | 1, True)
SYMBOLS = list(request(*SENT, 2))
OTHERS = ([], [ONE], [ZERO], [MARK], [ONE, ZERO], [MARK, MARK])


def test_no_single_wrong_pulse_makes_another_request(read):
    """Each pulse of a request is replaced, left out and doubled; none of these is another request."""
    assert read(SYMBOLS) == [SENT]
    symbols, count = [MARK], 0
    for place, other in itertools.product(range(len(SYMBOLS)), OTHERS):
        if other != [SYMBOLS[place]]:
            symbols += [*SYMBOLS[:place], *other, *SYMBOLS[place + 1 :], ONE, MARK]
            count += 1
    taken = read(symbols)
    assert set(taken) <= {SENT}
    # Seven bits of the check bytes carry nothing; a mark more does no harm, nor one less after another packet's.
    assert len(taken) == 7 + 2 + 1
    assert count == 6 * len(SYMBOLS) - len(SYMBOLS)


def test_commands_come_as_pulses_too(bench, rng):
    for clocks in BITS:
        sent = [(rng.randrange(1, 1 << 21), rng.randrange(128), rng.randrange(1 << 21)) for _ in range(3)]
        data = b"".join(command(*one, hello=True, bit_clocks=clocks) for one in sent)
        assert [(one.number, *one.command) for one in heard([(0, data)], clocks, commands=True).requests] == sent
        assert heard([(0, data)], clocks).requests == []
    dut = Listener(PulseReceiver(BITS[0]), commands=True)
    sim, reader = bench(dut), dut.reader
    data = b"".join(command(*one, hello=True, bit_clocks=BITS[0]) for one in sent)
    cycles = dut.receive(sim, line(data, BITS[0]))
    command_, what, value, number = map(sim.watch, (reader.command, reader.what, reader.value, reader.number))
    sim.run(cycles)
    cycles = [cycle for cycle, high in enumerate(command_.values) if high]
    assert [(number[cycle + 1], what[cycle], value[cycle]) for cycle in cycles] == sent
    assert cycles == [one.cycle for one in heard([(IDLE, data)], BITS[0], commands=True).requests]
