"""Packets without their delimiter and check bytes."""

from contactfpga.skin.derived import Widths
from contactfpga.wire import protocol


def decoded(packet, skin):
    assert packet.endswith(b"\0")
    assert packet.count(b"\0") == 1
    return protocol.decode_frame(unsealed(packet, skin), Widths(skin.sheet))


def unsealed(packet, skin):
    return protocol.unseal(packet.strip(b"\0"), protocol.check_prefix(skin))
