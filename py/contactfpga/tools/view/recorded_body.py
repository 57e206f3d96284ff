"""A recording of all boards of a robot, which plays."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from contactfpga.robot.body import LinkState, packed
from contactfpga.robot.body.plan import Plan
from contactfpga.tools.view.fingers import Touchable
from contactfpga.tools.view.playback import Playback
from contactfpga.zones.zone import Zones

if TYPE_CHECKING:
    from contactfpga.tools.recordings import Recording


class BodyPlayer(Playback[tuple[str, Zones]]):
    """Plays all links of a robot. Raises :class:`~contactfpga.ContactFPGAError` where the recording holds no robot."""

    def __init__(self, recording: Recording, clock: Callable[[], float] = time.monotonic):
        super().__init__(recording.duration_s, clock)
        self.title = recording.path.name
        self.virtual: dict[str, Touchable] = {}  # nobody can press what was recorded
        self._recording = recording
        self._folder = tempfile.TemporaryDirectory(prefix="contactfpga-")
        try:
            self.body = packed.unpack(recording.texts(packed.ROBOT)[0], Path(self._folder.name))
        except BaseException:
            self._folder.cleanup()
            raise
        kinematics = self.body.kinematics
        self.angles: dict[str, float] = dict.fromkeys(kinematics.joint_names if kinematics else (), 0.0)
        self._newest: dict[str, tuple[float, Zones]] = {}

    def begin(self, start_s: float) -> Iterator[tuple[float, tuple[str, Zones]]]:
        self._newest = {}
        return ((seconds, (link, zones)) for seconds, link, zones in self._recording.frames(start_s))

    def follow(self, seconds: float, item: tuple[str, Zones]) -> None:
        link, zones = item
        if link in self.body.links:
            self._newest[link] = seconds, zones

    def states(self) -> dict[str, LinkState]:
        """Of all links, at the next moment."""
        self.step()
        return {name: self._state(plan) for name, plan in self.body.links.items()}

    def _state(self, plan: Plan) -> LinkState:
        if plan.name not in self._newest:
            return LinkState(None, None, "silent", "no frame up to here")
        seconds, zones = self._newest[plan.name]
        age_s = max(0.0, self.position_s - seconds)
        if zones.sheet != plan.skin.sheet:
            return LinkState(None, age_s, "mismatch", "a board of another Skin was recorded")
        if age_s > plan.silent_s:
            return LinkState(None, age_s, "silent", f"no frame for {age_s:.3f} s")
        return LinkState(zones, age_s, "ok" if age_s <= plan.late_s else "late", "", seconds)

    def close(self) -> None:
        super().close()
        self._folder.cleanup()


def holds_robot(recording: Recording) -> bool:
    """Whether a recording holds a robot with all files of its table; those of earlier versions hold the table alone."""
    texts = recording.texts(packed.ROBOT)
    return bool(texts) and set(texts[0]) != {packed.TOML}
