"""Number of the lowest bit that is set."""

from amaranth.hdl import Cat, Mux, Value


def lowest(bits: Value) -> Value:
    """By halves; of no bit the highest number."""
    if len(bits) <= 2:
        return ~bits[0]
    half = 1 << (len(bits) - 1).bit_length() - 1
    low, high = bits[:half], bits[half:]
    any_low = low.any()
    return Cat(Mux(any_low, lowest(low), lowest(high))[: (half - 1).bit_length()], ~any_low)
