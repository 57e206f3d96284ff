"""The host's clock at the moments of frames that arrive: looks once at what comes at once."""

from __future__ import annotations

from contactfpga.driver.clock_fit import ClockFit
from contactfpga.zones.host_line import HostLine


class HostClock:
    """A fit of clocks for one conversation; a recording, which is not ``live``, has none."""

    def __init__(self, live: bool):
        self.byte_s = 0.0
        """What a byte takes on the wire."""
        self._fit = ClockFit() if live else None
        self._line: HostLine | None = None  # for the frames that come now
        self._latest: tuple[int, int] | None = None  # time and bytes of the last of them

    def begin(self, now: float) -> None:
        """Packets came."""
        self._line = None if self._fit is None else self._fit.line(now)

    def take(self, time_us: int, size: int, now: float, asked_s: float | None) -> HostLine | None:
        """A frame of so many bytes is among them, or the last of a run; ``asked_s``: the request was sent then that it
        answers first."""
        if self._fit is None:
            return None
        self._latest = time_us, size
        if self._line is None or asked_s is not None:  # else the last one of those that came at once says the most
            self.end(now)
            if asked_s is not None:
                self._fit.answered(time_us, asked_s)
            self._line = self._fit.line(now)
        return self._line

    def end(self, now: float) -> None:
        """These were all."""
        if self._fit is not None and self._latest is not None:
            time_us, size = self._latest
            self._fit.arrived(time_us, now, size * self.byte_s)
        self._latest = None

    def forget(self) -> None:
        """The board was restarted, or is another one."""
        self._line = self._latest = None
        if self._fit is not None:
            self._fit.forget()
