"""Counts and indexes of set bits."""

from collections.abc import Iterable

from amaranth.hdl import Cat, Mux, Value


def popcount(bits: Iterable[Value]) -> Value | int:
    """The sum of bits or of numbers, added in pairs."""
    numbers = list(bits)
    while len(numbers) > 1:
        pairs = [a + b for a, b in zip(numbers[::2], numbers[1::2], strict=False)]
        numbers = pairs + numbers[len(pairs) * 2 :]
    return numbers[0] if numbers else 0


def lowest(bits: Value) -> Value:
    """Index of the lowest set bit by binary split; the highest index if none is set."""
    if len(bits) <= 2:
        return ~bits[0]
    half = 1 << (len(bits) - 1).bit_length() - 1
    low, high = bits[:half], bits[half:]
    any_low = low.any()
    return Cat(Mux(any_low, lowest(low), lowest(high))[: (half - 1).bit_length()], ~any_low)
