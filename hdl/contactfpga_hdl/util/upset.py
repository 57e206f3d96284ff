"""Registers that flip though nothing wrote them, as radiation makes them."""

from amaranth.hdl import Module, Signal, Value


def upset(m: Module, name: str, word: Value, writes: Value, toggles: Value | int = 0) -> Value:
    """High in the clock in which a bit of ``word`` is another one than in the clock before, though ``writes`` was low
    then; it must be high in all clocks that change the word in a way that ``toggles`` does not tell: how many of its
    bits change, modulo 2. A flip beside a write goes unseen."""
    odd, written = Signal(name=f"{name}_odd"), Signal(name=f"{name}_written", init=1)
    m.d.sync += [odd.eq(word.xor() ^ toggles), written.eq(writes)]
    return ~written & (odd ^ word.xor())


def upset_places(first: Value, second: Value, third: Value) -> Value:
    """High while these are not 0, 1 and 2 in any order, by a flip of one of their six bits."""
    return first ^ second ^ third != 0b11


def upset_count(m: Module, name: str, count: Value, ticks: Value) -> Value:
    """The same of a counter: 15 of 16 ticks can be foretold from its lowest bits, which costs less than all."""
    low = count[:4]
    toggles = ~low[0] | low[1] & ~low[2]
    return upset(m, name, count, ticks & low.all(), ticks & toggles)
