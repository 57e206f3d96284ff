"""What a page of the view says and hears, without a browser."""

import socket
import time

import msgspec
import viser
import zstandard
from viser import _messages
from websockets.sync.client import connect


class Page:
    """Its WebSocket; a context manager."""

    def __init__(self, port, guard, **asked):
        self._socket = socket_of(port, guard, **asked)
        self.heard = []
        """Messages as dictionaries."""
        self._waiting = []

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._socket.close()

    def say(self, *messages):
        for message in messages:
            self._socket.send(msgspec.msgpack.encode(message.as_serializable_dict([])))

    def hear(self, wanted, seconds=180.0):
        """Until a message is ``wanted``, which is returned."""
        until = time.monotonic() + seconds
        while time.monotonic() < until:
            while self._waiting:
                self.heard.append(message := self._waiting.pop(0))
                if wanted(message):
                    return message
            self._waiting += unpacked(self._socket.recv(timeout=seconds))
        raise AssertionError(f"heard only {sorted({message['type'] for message in self.heard})}")


def socket_of(port, guard, *, origin=None, token=True, host=None, query=""):
    """As the page opens it, but for what is asked otherwise."""
    name = host or f"127.0.0.1:{port}"
    return connect(
        f"ws://{name}/{query}",
        sock=socket.create_connection(("127.0.0.1", port)),
        origin=f"http://127.0.0.1:{port}" if origin is None else origin or None,
        additional_headers={"Cookie": cookie(port, guard)} if token else {},
        subprotocols=[f"viser-v{viser.__version__}"],
        proxy=None,
        compression=None,
        open_timeout=60,
        max_size=None,
    )


def cookie(port, guard):
    return f"contactfpga-view-{port}={guard.token}"


def camera(position=(0.0, 0.0, 1.0), size=(100, 100)):
    """What a page says first. It looks straight down; ``size``: width and height of its window."""
    pose, lens = ((0.0, 1.0, 0.0, 0.0), position), (0.7, 0.01, 10.0)
    return _messages.ViewerCameraMessage(*pose, *lens, *size[::-1], (*position[:2], 0.0), (0.0, 1.0, 0.0))


def click(node, ray_origin=(0.0, 0.0, 1.0), ray_direction=(0.0, 0.0, -1.0)):
    return _messages.SceneNodeClickMessage(node, 0, ray_origin, ray_direction, (0.5, 0.5), None)


def drag(node, phase, start, end):
    places = (start, (0.5, 0.5), end, (0.5, 0.5))
    return _messages.SceneNodeDragMessage(phase, node, 0, *places, "left", None)


def unpacked(data):
    """The messages of one packet of viser's."""
    size = int.from_bytes(data[8:16], "little")
    packet = msgspec.msgpack.decode(zstandard.ZstdDecompressor().decompress(data[16 : 16 + size], 1 << 26))
    offset = 16 + size
    buffers = []
    for length in packet["binaryBufferLengths"]:
        offset += -offset % 8
        buffers.append(data[offset : offset + length])
        offset += length
    return [filled(message, buffers) for message in packet["messages"]]


def filled(value, buffers):
    if isinstance(value, dict):
        if "__binary_index" in value:
            return buffers[value["__binary_index"]]
        return {key: filled(each, buffers) for key, each in value.items()}
    return [filled(each, buffers) for each in value] if isinstance(value, (list, tuple)) else value
