"""A port for the real driver whose time is that of the plant."""

from __future__ import annotations

from contactfpga_sim.lab.arm.world import World


class PlantTransport:
    """A :class:`contactfpga.driver.transport.Transport`: while the driver waits, arm and gateware go on."""

    live, threaded = True, False
    name = "arm://"

    def __init__(self, world: World):
        self._world = world

    def read(self, timeout_s: float) -> bytes:
        until = self._world.clock() + timeout_s
        while not (data := self._world.delivered()) and self._world.clock() < until:
            self._world.step()
        return data

    def write(self, data: bytes) -> None:
        self._world.send(data)

    def clock(self) -> float:
        return self._world.clock()

    def close(self) -> None:
        pass
