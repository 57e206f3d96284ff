"""What the product reads in bytes that a board sent: whole streams, and packets without delimiter and check bytes."""

from contactfpga.skin.derived import Widths
from contactfpga.wire import framing, protocol
from contactfpga.wire.hello import KIND_HELLO


def decoded(data, skin):
    """Frames and plain hellos in whole packets; what comes after the last delimiter does not count."""
    widths, before = Widths(skin.sheet), protocol.check_prefix(skin)
    frames, hellos = [], []
    for packet in data[: data.rfind(0) + 1].split(b"\0"):
        if not packet:
            continue
        plain = framing.unseal(packet, before)
        if framing.kind_of(plain) == KIND_HELLO:
            hellos.append(plain)
        else:
            frames.append(protocol.decode_frame(plain, widths))
    return frames, hellos


def frame_in(packet, skin):
    assert packet.endswith(b"\0")
    assert packet.count(b"\0") == 1
    return protocol.decode_frame(unsealed(packet, skin), Widths(skin.sheet))


def unsealed(packet, skin):
    return protocol.unseal(packet.strip(b"\0"), protocol.check_prefix(skin))
