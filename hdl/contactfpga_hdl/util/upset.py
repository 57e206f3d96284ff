"""Registers that turn though nothing wrote them, as radiation makes them."""

from amaranth.hdl import Module, Signal, Value


def upset(m: Module, name: str, word: Value, writes: Value) -> Value:
    """High in the clock in which a bit of ``word`` is another one than in the clock before, though ``writes`` was low
    then; it must be high in all clocks that change the word. A flip beside a change goes unseen."""
    odd, written = Signal(name=f"{name}_odd"), Signal(name=f"{name}_written", init=1)
    m.d.sync += [odd.eq(word.xor()), written.eq(writes)]
    return ~written & (odd ^ word.xor())
