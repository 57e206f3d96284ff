"""Random frames as a board would send them, and what the product reads in bytes: streams, and packets one by one."""

import numpy as np
from wire import Wire
from zone_oracles import nearest

from contactfpga.skin.derived import Widths
from contactfpga.wire import framing, protocol
from contactfpga.wire.hello import KIND_HELLO
from contactfpga_sim.model.golden.label import labelling


def moments(rng, skin, zones):
    """(area, sum x, sum y) of zones that could be on the sheet, of few cells each."""
    rows = []
    for _ in range(zones):
        area = rng.randrange(1, 10)
        row = area, rng.randrange(area * (skin.columns - 1) + 1), rng.randrange(area * (skin.rows - 1) + 1)
        rows.append(row + ((past(rng, skin, area),) if skin.closed else ()))
    return rows


def reaching(rng, skin):
    """Records with extents, of zones of random cells; now and then a field is one more or less."""
    cells = np.random.default_rng(rng.getrandbits(32)).random((skin.rows, skin.columns)) < rng.choice([0.1, 0.4, 0.7])
    found = []
    for zone in labelling(cells, skin.connectivity, skin.labeller, skin.closed).departures:
        x, y = zone.sum_x, zone.sum_y
        if skin.report == "barycenter":
            x, y = (nearest(total, zone.area, skin.barycenter_bits) for total in (x, y))
        record = [zone.area, x, y, *([zone.turned] if skin.closed else []), *zone.extent]
        if rng.random() < 0.05:
            place = rng.randrange(1, len(record))
            record[place] = max(0, record[place] + rng.choice([-1, 1])) % (1 << skin.derived.record_bits[place])
        found.append(tuple(record))
    return found


def past(rng, skin, area):
    """Cells past the seam, or a ring, or wound."""
    return rng.choice([rng.randrange(area), area, (1 << (skin.rows * skin.columns).bit_length()) - 1])


def frame(rng, skin, zones=None):
    """A frame as sent, with its delimiter; ``zones``: how many, where the Skin reports zones."""
    options = {name: rng.randrange(1 << bits) for name, bits in (("time", 24), ("sequence", 8), ("overwritten", 4))}
    options["heard"] = rng.randrange(8)
    options["flags"] = ["fault"] if rng.random() < 0.2 else []
    if skin.report == "cells":
        bitmap = [[rng.random() < 0.3 for _ in range(skin.columns)] for _ in range(skin.rows)]
        return Wire(skin).cells(bitmap, **options)
    return Wire(skin).zones(moments(rng, skin, zones), **options)


def receiver(skin):
    """The product's verdict on a packet without its delimiter, as a function."""
    widths, prefix = Widths(skin.sheet), protocol.check_prefix(skin)

    def accepts(packet):
        try:
            plain = protocol.unseal(packet, prefix)
            if protocol.kind_of(plain) == protocol.KIND_HELLO:
                return protocol.HelloReader().take(plain) is not None
            protocol.decode_frame(plain, widths)
        except protocol.PacketError:
            return False
        return True

    return accepts


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
