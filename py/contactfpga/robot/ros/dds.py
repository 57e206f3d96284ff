"""Publish to ROS 2 nodes without ROS, by Cyclone DDS, by default on this computer alone."""

from __future__ import annotations

import contextlib
import functools
import os
import re
import socket
import sys
from collections.abc import Callable
from typing import Any, TypeVar

from contactfpga.errors import BoardClosed, MissingExtra
from contactfpga.inputs.values import shown, whole
from contactfpga.robot.ros import MAX_DOMAIN
from contactfpga.robot.ros.settings import TOPICS, Topic
from contactfpga.robot.ros.types import MessageField, message_type, type_hash

_Made = TypeVar("_Made")

DEVICE = b"lo"
_FOLDER = "/proc/self/fd"


def kept_inside(make: Callable[[], _Made]) -> _Made:
    """The result of ``make``, whose opened sockets accept packets from this computer alone. On Linux since 5.7;
    elsewhere without effect."""
    if not sys.platform.startswith("linux"):
        return make()
    before = set(_sockets())
    made = make()
    for name, number in _sockets().items():
        if name not in before:
            _keep_inside(number)
    return made


def _sockets() -> dict[str, int]:
    found = {}
    for number in os.listdir(_FOLDER):
        with contextlib.suppress(OSError):  # closed meanwhile
            name = os.readlink(f"{_FOLDER}/{number}")
            if name.startswith("socket:"):
                found[name] = int(number)
    return found


def _keep_inside(number: int) -> None:
    with contextlib.suppress(OSError), socket.socket(fileno=os.dup(number)) as found:  # not by an older Linux
        if found.family == socket.AF_INET and found.type == socket.SOCK_DGRAM:
            found.setsockopt(socket.SOL_SOCKET, socket.SO_BINDTODEVICE, DEVICE)


LOCALHOST = """<CycloneDDS><Domain Id="any">
<General><AllowMulticast>false</AllowMulticast>
<Interfaces><NetworkInterface address="127.0.0.1"/></Interfaces></General>
<Discovery><ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>32</MaxAutoParticipantIndex>
<Peers><Peer address="127.0.0.1"/></Peers></Discovery>
{compatibility}</Domain></CycloneDDS>"""
NETWORK = '<CycloneDDS><Domain Id="any">{compatibility}</Domain></CycloneDDS>'
_NO_TYPE_INFORMATION = "<Compatibility><IgnoreTypeInformation>1.15</IgnoreTypeInformation></Compatibility>"
"""Fast DDS of Kilted describes types differently from Cyclone; the hash in the user data distinguishes them."""


class Publisher:
    """A participant with a writer for each topic; a context manager."""

    def __init__(self, namespace: str = "skin", domain: int = 0, network: bool = False):
        """Join ``domain`` (ROS_DOMAIN_ID) on this computer alone, unless ``network``; topics are in ``namespace``.
        Raises :class:`~contactfpga.MissingExtra`."""
        try:
            from cyclonedds.domain import Domain, DomainParticipant
        except ModuleNotFoundError as error:
            raise MissingExtra(f"publishing to ROS 2 ({error})", "ros") from None
        if not re.fullmatch(r"/?[A-Za-z_][A-Za-z0-9_]*(/[A-Za-z_][A-Za-z0-9_]*)*", namespace):
            raise ValueError(f"namespace is {shown(namespace)}; it has letters, digits and _, and / between parts")
        if whole(domain) is None or not 0 <= domain <= MAX_DOMAIN:
            raise ValueError(f"domain is {shown(domain)}; it must be a whole number from 0 to {MAX_DOMAIN}")
        form = NETWORK if network else LOCALHOST
        self._namespace = namespace
        config = form.format(compatibility=_NO_TYPE_INFORMATION)

        def join() -> tuple[Any, Any]:
            return Domain(domain, config), DomainParticipant(domain)

        self._domain, self._participant = join() if network else kept_inside(join)
        self._writers = {name: self._writer(topic) for name, topic in TOPICS.items()}

    def topic(self, name: str) -> str:
        """The full name of a topic."""
        return TOPICS[name].resolved(self._namespace)

    def send(self, topic: str, data: bytes) -> None:
        """Publish a message by a key of :data:`TOPICS`. Raises :class:`~contactfpga.BoardClosed` after
        :meth:`close`."""
        if self._participant is None:
            raise BoardClosed("this publisher was closed; make another one")
        writer, kind = self._writers[topic]
        sample = object.__new__(kind)
        sample.serialize = lambda **_: data  # it is written already
        writer.write(sample)

    def subscribers(self, topic: str) -> int:
        """Current number of subscribers of a topic."""
        return len(self._writers[topic][0].get_matched_subscriptions())

    def _writer(self, topic: Topic) -> tuple[Any, Any]:
        from cyclonedds.pub import DataWriter
        from cyclonedds.topic import Topic as DdsTopic

        kind = idl_type(topic.type)
        made = DdsTopic(self._participant, f"rt{self.topic(topic.name)}", kind)
        return DataWriter(self._participant, made, qos=qos_of(topic)), kind

    def close(self) -> None:
        """Leave the domain; may be called twice."""
        self._writers.clear()
        self._participant = self._domain = None

    def __enter__(self) -> Publisher:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def qos_of(topic: Topic) -> Any:
    """Quality of service of a topic's writer, also for readers."""
    from cyclonedds.core import Policy, Qos
    from cyclonedds.util import duration

    return Qos(
        Policy.Reliability.Reliable(duration(milliseconds=100)),
        Policy.Durability.TransientLocal if topic.latched else Policy.Durability.Volatile,
        Policy.History.KeepLast(topic.depth),
        Policy.DataRepresentation(use_cdrv0_representation=True),
        Policy.Userdata(f"typehash={type_hash(topic.type)};".encode()),
    )


@functools.cache
def idl_type(name: str) -> Any:
    """The cyclonedds type, under its ROS 2 name on the wire."""
    from cyclonedds.idl import make_idl_struct

    package, _, short = name.partition("/")
    fields = {field.name: _idl_field(field) for field in message_type(name).fields}
    return make_idl_struct(short, f"{package}.msg.dds_.{short}_", fields)


def _idl_field(field: MessageField) -> Any:
    from cyclonedds.idl import types

    plain: dict[str, Any] = {"string": str, "bool": bool, "byte": types.uint8}
    kind = idl_type(field.type) if field.nested else plain.get(field.type) or getattr(types, field.type)
    if field.count is None:
        return kind
    many: Any = types.array if field.count else types.sequence
    return many[kind, field.count] if field.count else many[kind]
