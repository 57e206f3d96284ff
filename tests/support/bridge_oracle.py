"""A second opinion on the USB bridge: AN232B-04 said again, for one phase, as a loop over frames and a list of bytes."""


def brute(settings, mhz, line, byte, phase_us):
    """When a byte is with the host, in us, of a chip that sends all it holds at ``phase_us``; ``mhz``: the board's clock."""
    buffer, ready, place, arrived = [], [], 0, []
    frame, sent = settings.chip.frame_us, phase_us
    fed = [(time / mhz, value, number) for number, (time, value) in enumerate(zip(line.times, line.values))]
    at = phase_us
    first = True
    while True:
        while place < len(fed) and fed[place][0] <= at:
            _, value, number = fed[place]
            place += 1
            buffer.append(number)
            full = len(buffer) == settings.chip.payload_bytes
            if full or (settings.event is not None and value == settings.event and len(buffer) >= 2):
                ready.append(buffer)
                buffer = []
        if first or round(at - sent, 6) >= 1000 * settings.timer_ms:
            ready.append(buffer)
            buffer = []
        first = False
        bus = 0.0
        for one in ready:
            bus += settings.packet_us(len(one))
            if byte in one:
                return at + bus
            arrived += one
        sent = at if ready else sent
        ready = []
        at += frame
