"""Packets of pressure units, what a hello says of them, and their commands."""

import dataclasses

import pytest
from wire import digits

from contactfpga import Skin
from contactfpga.wire import protocol
from contactfpga.wire.framing import PacketError
from contactfpga.wire.units import (
    Sweep,
    UnitFacts,
    decode_sweep,
    encode_sweep,
    sum_threshold_value,
    threshold_value,
    zero_value,
)

SKIN = Skin(units=6, unit_sums=[[1] * 6, [127] * 6])
FACTS = UnitFacts.of(SKIN.derived.units)
WIDE = dataclasses.replace(FACTS, bits=24, sum_bits=30)


def plain(readings, time_us=77, sequence=3, flags=0, width=2):
    """As docs/protocol.md has it."""
    data = b"".join(digits(reading, width) for reading in readings)
    return data + digits(time_us + sequence * 2**24, 5) + bytes([0x80 + flags])


@pytest.mark.parametrize(("facts", "width", "most"), [(FACTS, 2, 4095), (WIDE, 4, 2**24 - 1)])
def test_a_sweep_is_read_and_written(facts, width, most):
    data = plain([0, 1, most, 130, 2048, most], 2**24 - 1, 255, 2, width)
    sweep = Sweep(2**24 - 1, 255, (0, 1, most, 130, 2048, most), over=False, armed=True)
    assert decode_sweep(data, facts) == sweep
    assert encode_sweep(sweep, facts.bits) == data
    assert decode_sweep(plain([0] * 6, flags=1, width=width), facts).over


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (plain([0] * 5), "length"),
        (plain([0] * 7), "length"),
        (plain([4096] + [0] * 5), "content"),
        (plain([0] * 6, sequence=256), "content"),
        (b"\x01" + plain([0] * 6)[1:], "content"),
    ],
)
def test_what_is_no_sweep_is_refused(data, reason):
    with pytest.raises(PacketError) as caught:
        decode_sweep(data, FACTS)
    assert caught.value.reason == reason


def test_a_hello_says_what_units_there_are():
    """12 MHz, 1 MHz SPI: 20 SPI clocks of 12 clocks each a conversion. Sums of up to 6 * 127 * 4095."""
    hello = protocol.HelloReader().take(protocol.unseal(protocol.encode_hello(SKIN)[1:-1], b""))
    assert hello.units == UnitFacts(6, 12, 2, 22, 240, 1440)
    assert list(hello.commands) == [3, 4, 5]
    bare = protocol.HelloReader().take(protocol.unseal(protocol.encode_hello(Skin())[1:-1], b""))
    assert (bare.units, bare.commands) == (None, b"")


def test_commands_carry_number_and_place():
    assert zero_value(FACTS, 5, 4095) == (3, 5 + 8 * 4095)
    assert threshold_value(FACTS, 0, 100) == (4, 800)
    assert threshold_value(FACTS, 0, 0) == (4, 0)
    assert sum_threshold_value(FACTS, 1, 1600) == (5, 1 + 8 * 100)  # in steps of 16
    assert sum_threshold_value(FACTS, 1, 3) == (5, 1 + 8)  # never off by rounding
    assert sum_threshold_value(FACTS, 1, 0) == (5, 1)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        ((zero_value, 6, 0), "unit is 6; this board has 6, counted from 0"),
        ((zero_value, 0, 4096), "zero of unit 0 is 4096; it must be a whole number from 0 to 4095"),
        ((threshold_value, "a", 1), "unit is 'a'; this board has 6"),
        ((threshold_value, 1, -1), "threshold of unit 1 is -1"),
        ((sum_threshold_value, 2, 1), "sum is 2; this board has 2, counted from 0"),
        ((sum_threshold_value, 0, 0.5), "threshold of sum 0 is 0.5"),
    ],
)
def test_what_no_command_can_say_is_refused(call, message):
    value, *arguments = call
    with pytest.raises(ValueError, match=message):
        value(FACTS, *arguments)
