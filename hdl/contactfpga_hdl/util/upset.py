"""Detection of registers that flip without a write, for instance by radiation."""

from amaranth.hdl import Module, Signal, Value


def upset(m: Module, name: str, word: Value, writes: Value, toggles: Value | int = 0) -> Value:
    """High in the clock in which a bit of ``word`` differs from the clock before, though ``writes`` was low then.
    ``writes`` must be high in all clocks that change the word, except changes given by ``toggles``: the number of
    changing bits, modulo 2. A flip in the clock of a write is unseen."""
    odd, written = Signal(name=f"{name}_odd"), Signal(name=f"{name}_written", init=1)
    m.d.sync += [odd.eq(word.xor() ^ toggles), written.eq(writes)]
    return ~written & (odd ^ word.xor())


def upset_places(first: Value, second: Value, third: Value) -> Value:
    """High while these are not 0, 1 and 2 in any order, because one of their six bits flipped."""
    return first ^ second ^ third != 0b11


def upset_count(m: Module, name: str, count: Value, ticks: Value) -> Value:
    """:func:`upset` for a counter: 15 of 16 ticks are predictable from its lowest bits, which costs less than all."""
    low = count[:4]
    toggles = ~low[0] | low[1] & ~low[2]
    return upset(m, name, count, ticks & low.all(), ticks & toggles)
