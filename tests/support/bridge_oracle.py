"""A second opinion on the USB bridge: AN232B-04 said again, for one phase, as a loop over frames."""


def brute(settings, mhz, line, byte, phase_us):
    """When a byte is with the host, in us, if the chip sends all that it holds at ``phase_us``; ``mhz``: the clock."""
    coming = [(time / mhz, value, number) for number, (time, value) in enumerate(zip(line.times, line.values))]
    coming.reverse()
    at = sent = phase_us
    held = []
    while True:
        ready = []
        while coming and coming[-1][0] <= at:
            _, value, number = coming.pop()
            held.append(number)
            full = len(held) == settings.chip.payload_bytes
            if full or (settings.event is not None and value == settings.event and len(held) >= 2):
                ready.append(held)
                held = []
        if at == phase_us or round(at - sent, 6) >= 1000 * settings.timer_ms:
            ready.append(held)
            held = []
        bus_us = 0.0
        for packet in ready:
            bus_us += settings.packet_us(len(packet))
            if byte in packet:
                return at + bus_us
        sent = at if ready else sent
        at += settings.chip.frame_us / settings.asks
