"""Publishing by Cyclone DDS, read back by another participant of the same process."""

import os
import socket
import sys
import time
from pathlib import Path

import pytest
from ros_messages import HEAD, samples

import contactfpga
from contactfpga.robot.ros import dds
from contactfpga.robot.ros.cdr import encode
from contactfpga.robot.ros.settings import TOPICS

pytest.importorskip("cyclonedds")

DOMAIN = 100 + os.getpid() % 100
"""Of this process alone, lest it meets what else runs here."""


@pytest.fixture
def publisher():
    with dds.Publisher("arm/skin", DOMAIN) as publisher:
        yield publisher


def reader(publisher, name, qos=None):
    from cyclonedds.sub import DataReader
    from cyclonedds.topic import Topic

    topic, participant = TOPICS[name], publisher._participant
    made = Topic(participant, f"rt{publisher.topic(name)}", dds.idl_type(topic.type))
    return DataReader(participant, made, qos=qos or dds.qos_of(topic))


def of_subscriber(kind):
    """What a node asks for, written here: `reliable` as RViz's displays do, or `best effort` as for sensors."""
    from cyclonedds.core import Policy, Qos
    from cyclonedds.util import duration

    wanted = {
        "reliable": Policy.Reliability.Reliable(duration(seconds=1)),
        "best effort": Policy.Reliability.BestEffort,
    }
    return Qos(
        wanted[kind],
        Policy.Durability.Volatile,
        Policy.History.KeepLast(5),
        Policy.DataRepresentation(use_cdrv0_representation=True),
    )


def taken(reader):
    until = time.monotonic() + 60
    while not (found := reader.take(10)):
        assert time.monotonic() < until, "nothing came"
        time.sleep(0.005)
    return found


def same_type(name):
    return next(message for kind, message in samples() if kind == TOPICS[name].type)


@pytest.mark.parametrize("name", ["zones", "tracks", "contacts", "markers", "/diagnostics"])
def test_cyclone_reads_what_we_write(publisher, name):
    """Its own reading of the bytes, by its own description of the type."""
    read = reader(publisher, name)
    publisher.send(name, data := encode(TOPICS[name].type, same_type(name)))
    (sample,) = taken(read)
    # Only what cyclonedds writes tells whether it read the same; its floats of 32 bits are ours already.
    assert sample.serialize(use_version_2=False)[4:] == data[4:]


@pytest.mark.parametrize("kind", ["reliable", "best effort"])
@pytest.mark.parametrize("name", ["zones", "markers"])
def test_reliable_and_best_effort_subscribers_both_receive(publisher, name, kind):
    read = reader(publisher, name, of_subscriber(kind))
    publisher.send(name, data := encode(TOPICS[name].type, same_type(name)))
    (sample,) = taken(read)
    assert sample.serialize(use_version_2=False)[4:] == data[4:]


def test_who_comes_late_gets_the_skin(publisher):
    publisher.send("skin", encode(TOPICS["skin"].type, same_type("skin")))
    (sample,) = taken(reader(publisher, "skin"))
    assert (sample.rows, sample.header.frame_id) == (16, HEAD["frame_id"])


def test_names_on_the_wire_are_those_of_ros(publisher):
    assert reader(publisher, "zones").topic.name == "rt/arm/skin/zones"
    assert reader(publisher, "/diagnostics").topic.typename == "diagnostic_msgs::msg::dds_::DiagnosticArray_"


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="only Linux can hold packets from outside back")
def test_no_socket_takes_packets_from_outside(publisher):
    publisher.send("zones", encode(TOPICS["zones"].type, same_type("zones")))
    found = []
    for entry in Path("/proc/self/fd").iterdir():
        try:
            with socket.socket(fileno=socket.dup(int(entry.name))) as one:
                if one.family in (socket.AF_INET, socket.AF_INET6):
                    bound = one.getsockopt(socket.SOL_SOCKET, socket.SO_BINDTODEVICE, 16).rstrip(b"\0")
                    found.append((one.getsockname()[0], bound))
        except OSError:
            continue
    assert found
    assert [one for one in found if one[1] != b"lo" and not one[0].startswith("127.")] == []


@pytest.mark.parametrize(
    ("given", "said"),
    [
        *(((name, DOMAIN), "namespace is .*; it has letters, digits and _") for name in ("", "a b", "1arm", "arm/")),
        *((("skin", domain), "domain is .*; it must be a whole number from 0 to 232") for domain in (-1, 233, 1.5)),
    ],
)
def test_a_namespace_or_domain_that_dds_lacks_is_refused(given, said):
    with pytest.raises(ValueError, match=said):
        dds.Publisher(*given)


def test_a_closed_publisher_says_so(publisher):
    publisher.close()
    publisher.close()
    with pytest.raises(contactfpga.BoardClosed, match="this publisher was closed"):
        publisher.send("zones", b"")
