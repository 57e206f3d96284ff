"""A board that sends a stream, and a recording of it."""

import contextlib
from operator import itemgetter

from fake_board import wait_until
from mcap.reader import make_reader
from mcap.writer import Writer
from model_board import ModelBoard

import contactfpga
from contactfpga import Skin
from contactfpga.recordings import Session
from contactfpga.tools.recordings.mcap_file import McapFile
from contactfpga.tools.recordings.messages import BYTES, of_bytes

SKIN = Skin()
NAMES = ("left arm", "chest")


class StreamPort:
    """A board in simulated time that sends ``hello_every`` frames, a hello, and so on; ``sent``: all of it."""

    def __init__(self, skin=SKIN, frames=600, hello_every=40, gap_us=904):
        self.model, self.left, self.every, self.gap_us = ModelBoard(skin), frames, hello_every, gap_us
        self.sent, self.seconds, self.out = b"", 0.0, b""
        self.empty_every = 1 << 30

    def write(self, data):
        for _, hello in self.model.hear(data):
            self.out += (self.model.hello() if hello else b"") + self.model.frame()

    def read(self, seconds):
        if self.left and not self.out:
            self.left -= 1
            self.out += self.model.hello() if self.model.sent % self.every == 0 else b""
            empty = self.model.sent % self.empty_every == self.empty_every - 1
            self.model.moments = [] if empty else [(4, 4 * (self.model.sent % 15), 6)]
            self.out += self.model.frame()
            self.model.time_us += self.gap_us
            self.seconds = self.model.time_us / 1e6
        elif not self.out:
            self.seconds += seconds
        data, self.out = self.out, b""
        self.sent += data
        return data

    def clock(self):
        return self.seconds

    def close(self):
        pass


def written(path, sent, added=()):
    """A closed recording of these bytes by link, and before them of the texts of links that were added in order."""
    file = McapFile(path)
    for link in added:
        file.metadata("contactfpga", {"link": link})
    for link, data in sent.items():
        file.write(f"/{link}/bytes", BYTES, link, 5, of_bytes(data, 5, link), 0.0)
    file.close()


def recorded(tmp_path, port=None, seconds=None, name="touches.mcap", **options):
    """The session, once all of the port has been taken."""
    port = port or StreamPort()
    session = Session(tmp_path / name, **options)
    with session:
        session.add(port, name="left hand")
        session.start(seconds)
        wait_until(lambda: session.wait(0.005) or not session.running or not port.left)
    return session


def recorded_both(file, **options):
    """The ports of two boards that differ in what they send."""
    ports = [StreamPort(frames=300), StreamPort(SKIN.replace(rows=8), frames=200, hello_every=30, gap_us=1404)]
    session = Session(file, **options)
    with session:
        for name, port in zip(NAMES, ports):
            session.add(port, name=name)
        session.start()
        wait_until(lambda: session.wait(0.005) or not any(port.left for port in ports))
    return ports, session


def rewritten(target, *sources, rename="", apart=False, **options):
    """Write all messages of some files by time, and their texts, with the library's writer. ``rename`` goes before the
    topics of all but the first. ``apart``: each has channels of its own, and messages have no sequence."""
    with contextlib.ExitStack() as opened, open(target, "wb") as new:
        readers = [make_reader(opened.enter_context(open(source, "rb"))) for source in sources]
        found = [(m.log_time, n, s, c, m) for n, reader in enumerate(readers) for s, c, m in reader.iter_messages()]
        writer, known = Writer(new, **options), {}
        writer.start()
        for text in (text for reader in readers for text in reader.iter_metadata()):
            writer.add_metadata(text.name, text.metadata)
        for _, number, schema, channel, message in sorted(found, key=itemgetter(0)):
            topic = (rename if number else "") + channel.topic
            key = topic, number if apart else 0
            if key not in known:
                kind = writer.register_schema(schema.name, schema.encoding, schema.data)
                known[key] = writer.register_channel(topic, channel.message_encoding, kind, channel.metadata)
            sequence = 0 if apart else message.sequence
            writer.add_message(known[key], message.log_time, message.data, message.publish_time, sequence)
        writer.finish()


def replayed(file):
    """The frames of a recording as the driver reads its bytes, each as a dict."""
    with contactfpga.open(f"replay://{file}") as board:
        return [zones.to_dict() for zones in board]
