"""What the C header sends to a board: requests, commands, and what commands say to pressure units."""

import functools
import random

import c_vectors
import pytest
from c_compilers import answers, program
from wire import request

from contactfpga.wire.command import Command, encode_command
from contactfpga.wire.protocol import encode_request, may_number
from contactfpga.wire.units import UnitFacts, sum_threshold_value, threshold_value, zero_value
from contactfpga_sim.model.golden.request import command

ASK = r"""
#include <stdio.h>
#include "contactfpga.h"
int main(void) {
    uint8_t out[CONTACTFPGA_PULSED_COMMAND_BYTES];
    unsigned long number, value;
    int what, hello, pulsed;
    while (scanf("%lu %d %lu %d %d", &number, &what, &value, &hello, &pulsed) == 5) {
        size_t length = what < 0
            ? contactfpga_request((uint32_t)number, hello, pulsed, out)
            : contactfpga_command((uint32_t)number, (uint8_t)what, (uint32_t)value, hello, pulsed, out);
        for (size_t i = 0; i < length; i++) printf("%02x", out[i]);
        printf("\n");
    }
    return 0;
}
"""


@pytest.fixture(scope="module")
def ask(tmp_path_factory):
    """Requests and commands by the header: of (number, what, value, hello, pulsed), ``what`` -1 for a request."""
    compiled = program(tmp_path_factory.mktemp("ask"), ASK)

    def run(asked):
        lines = "".join(" ".join(str(int(word)) for word in one) + "\n" for one in asked)
        return [bytes.fromhex(line) for line in answers(compiled, lines)]

    return run


@functools.cache
def asked() -> list[tuple[int, int, int, bool, bool]]:
    rng = random.Random(3)
    numbers = [0, 1, 129 * 128 + 1, 2**21 - 1, 2**21, 2**32 - 1, *(rng.randrange(2**21) for _ in range(300))]
    return [
        (number, rng.choice([-1, 1, 3, 127]), rng.getrandbits(21), rng.random() < 0.5, rng.random() < 0.5)
        for number in numbers
    ]


def test_requests_and_commands_are_those_of_the_golden_model(ask):
    for (number, what, value, hello, as_pulses), data in zip(asked(), ask(asked()), strict=True):
        bit_clocks = 2 if as_pulses else 8
        if not may_number(number):
            assert data == b""
        elif what < 0:
            assert data == request(number, hello, bit_clocks) == encode_request(number, hello, as_pulses)
        else:
            golden = command(number, what, value, hello, bit_clocks)
            assert data == golden == encode_command(number, Command(what, value), hello, as_pulses)


def test_a_command_that_cannot_be_is_not_written(ask):
    number = 129 * 128 + 1
    assert ask([(number, 128, 0, 0, 0), (number, 1, 2**21, 0, 0), (number, 255, 2**32 - 1, 0, 1)]) == [b""] * 3


def test_values_for_units_are_those_of_the_driver(tmp_path):
    code = r"""
#include <stdio.h>
#include "contactfpga.h"
int main(void) {
    static contactfpga_hello hello;
    unsigned what, place, units, bits, sums, sum_bits;
    unsigned long steps;
    while (scanf("%u %u %u %u %u %u %lu", &units, &bits, &sums, &sum_bits, &what, &place, &steps) == 7) {
        uint32_t value = 0;
        hello.units = (uint8_t)units, hello.unit_bits = (uint8_t)bits;
        hello.sums = (uint8_t)sums, hello.sum_bits = (uint8_t)sum_bits;
        bool taken = contactfpga_unit_value(&hello, (uint8_t)what, (uint8_t)place, (uint32_t)steps, &value);
        printf("%d %lu\n", taken, (unsigned long)value);
    }
    return 0;
}
"""
    rng, lines, meant = random.Random(4), [], []
    for _ in range(400):
        facts = UnitFacts(rng.randint(1, 8), rng.randint(1, 28), rng.randint(0, 4), rng.randint(1, 31), 1, 1)
        what, place = rng.randint(2, 6), rng.randint(0, 8)
        steps = rng.choice([0, 1, 2, rng.getrandbits(18), rng.getrandbits(28), rng.getrandbits(32)])
        shape = (facts.count, facts.bits, facts.sums, facts.sum_bits)
        lines.append(" ".join(map(str, (*shape, what, place, steps))) + "\n")
        meant.append(f"1 {found}" if (found := by_driver(facts, what, place, steps)) is not None else "0 0")
    assert answers(program(tmp_path, code), "".join(lines)) == meant


def by_driver(facts: UnitFacts, what: int, place: int, steps: int) -> int | None:
    commands = {3: zero_value, 4: threshold_value, 5: sum_threshold_value}
    try:
        return commands[what](facts, place, steps)[1] if what in commands else None
    except ValueError:
        return None


def test_vectors_to_the_board_by_c(ask):
    lines = c_vectors.text().split("\n# ")[-1].splitlines()[1:]
    meant = [bytes.fromhex(line[2:]) for line in lines[1::2]]
    asked = [[int(word) for word in line.split()[1:]] for line in lines[::2]]
    kinds = {5: lambda one: one, 3: lambda one: (one[0], -1, 0, *one[1:])}  # a request has no what and no value
    assert ask([kinds[len(one)](one) for one in asked]) == meant
    assert {len(one) for one in asked} == {3, 5}
