"""How many bits are set, or the sum of numbers: balanced trees of adders."""

from collections.abc import Iterable

from amaranth.hdl import Value


def popcount(bits: Iterable[Value]) -> Value | int:
    """The sum of bits or of numbers, added in pairs."""
    numbers = list(bits)
    while len(numbers) > 1:
        pairs = [a + b for a, b in zip(numbers[::2], numbers[1::2], strict=False)]
        numbers = pairs + numbers[len(pairs) * 2 :]
    return numbers[0] if numbers else 0
