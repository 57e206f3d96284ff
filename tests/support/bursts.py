"""Every burst in a packet, and what a receiver makes of it.

A packet is refused unless its check bytes are those of what stands before them, which is linear in the bits: what is
missing after an error is the exclusive-or of what each flipped bit adds. So for all bursts that put their zero bytes
into the same places this is a table look-up in numpy, and only what it leaves goes through the product one by one.
The tables are made with the product's own check bytes.
"""

import numpy as np

from contactfpga import protocol

BURSTS = np.arange(1, 1 << 16, 2, dtype=np.uint32)
"""Bursts of up to 16 bits, in the order of the line: the first bit is flipped, the last one is the highest that is."""

SHORTEST = protocol.CHECK_BYTES + 2


def wrong_packets(packet, following, accepts, bursts=BURSTS):
    """Packets the receiver accepts though they were not sent, as (first flipped bit, burst, packet).

    ``packet`` and ``following`` with their delimiters, as they follow a delimiter; each burst begins at each bit of
    ``packet`` and its delimiter. ``accepts(packet)``: the receiver's verdict.
    """
    stream = np.frombuffer(packet + following, np.uint8)
    sent = {packet[:-1], following[:-1]}
    starts = np.arange(8, dtype=np.uint32)
    errors = (bursts << starts[:, None]).ravel()  # as 24 bits from the lowest of the byte in which they begin
    parts = [(errors >> 8 * index & 0xFF).astype(np.uint8) for index in range(3)]
    found = []
    for begin in range(len(packet)):
        window = range(begin, begin + 3)
        zeros = sum(((stream[at] ^ part) == 0).astype(np.uint8) << k for k, (at, part) in enumerate(zip(window, parts)))
        for places in np.unique(zeros):
            same = np.flatnonzero(zeros == places)
            cut = [at for k, at in enumerate(window) if places >> k & 1]
            for first, last in _pieces(stream, window, cut):
                passing = same[_missing(stream, first, last, window, [part[same] for part in parts]) == 0]
                for index in passing:
                    received = stream.copy()
                    received[begin : begin + 3] ^= [part[index] for part in parts]
                    piece = received[first:last].tobytes()
                    if piece not in sent and accepts(piece):
                        found.append((8 * begin + int(index) // len(bursts), int(bursts[index % len(bursts)]), piece))
    return found


def wrong_packets_one_by_one(packet, following, accepts, bursts):
    """The same through the product alone."""
    sent, found = {packet[:-1], following[:-1]}, []
    for first in range(8 * len(packet)):
        for burst in bursts.tolist():
            word = int.from_bytes(packet + following, "little") ^ burst << first
            received = word.to_bytes(len(packet + following), "little")
            for piece in received.split(b"\0")[:-1]:
                if piece not in sent and accepts(piece):
                    found.append((first, burst, piece))
    return found


def _pieces(stream, window, cut):
    """What lies between two zeros, if it is long enough to be a packet and the window touches it."""
    ends = sorted({at for at in np.flatnonzero(stream == 0).tolist() if at not in window} | set(cut))
    for first, last in zip([0, *(end + 1 for end in ends)], ends):
        if last - first >= SHORTEST and first <= window[-1] + 1 and last >= window[0]:
            yield first, last


def _missing(stream, first, last, window, parts):
    """What the check bytes of stream[first:last] lack after each error; 0: nothing."""
    piece = bytearray(stream[first:last])
    base = _syndrome(piece)
    missing = np.full(len(parts[0]), base, np.uint32)
    for at, part in zip(window, parts):
        if first <= at < last:
            table = np.zeros(1, np.uint32)
            for bit in range(8):
                piece[at - first] ^= 1 << bit
                table = np.concatenate([table, table ^ np.uint32(_syndrome(piece) ^ base)])
                piece[at - first] ^= 1 << bit
            missing ^= table[part]
    return missing


def _syndrome(piece):
    stuffed, check = bytes(piece[: -protocol.CHECK_BYTES]), bytes(piece[-protocol.CHECK_BYTES :])
    return int.from_bytes(protocol.check_bytes(stuffed), "little") ^ int.from_bytes(check, "little")
