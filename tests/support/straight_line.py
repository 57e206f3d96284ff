"""A board whose bytes go straight to a conversation."""

from model_board import ModelBoard

import contactfpga
from contactfpga.driver.conversation import Arrival, Conversation

SKIN = contactfpga.Skin()


def arrived(events):
    return [event.zones for event in events if isinstance(event, Arrival)]


class Line:
    """A board whose bytes go straight to a conversation."""

    def __init__(self, skin=SKIN, live=True, expected=None):
        self.board = ModelBoard(skin)
        self.host = Conversation("x", expected, live)
        self.now = 0.0

    def give(self, *packets):
        """Frames that the host passes on of these bytes."""
        return arrived(self.host.receive(b"".join(packets), self.now))

    def hello(self, **options):
        return self.host.receive(self.board.hello(**options), self.now)

    def frame(self, **options):
        return self.give(self.board.frame(**options))

    def pause(self, seconds):
        """Nothing is sent, and nothing received."""
        self.board.time_us += round(seconds * 1e6)
        self.now += seconds

    @property
    def stats(self):
        return self.host.stats
