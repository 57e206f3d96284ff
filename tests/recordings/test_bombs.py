"""Recordings from strangers: what is packed in them costs no more memory and time than the limits say."""

import contextlib
import struct
import time
import tracemalloc

import pytest
from fake_board import wait_until
from recorded_stream import StreamPort, written

pytest.importorskip("mcap")

import lz4.frame
import zstandard
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    Channel,
    Chunk,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    Message,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
)

import contactfpga
from contactfpga import Skin
from contactfpga.recordings import Recording, Session
from contactfpga.tools.recordings.mcap import (
    FREE,
    KIND,
    LARGEST,
    MAGIC,
    MAX_LINKS,
    MAX_NAME,
    MAX_TEXTS,
    RecordingError,
    Unpacker,
    Unreadable,
    parsed,
)
from contactfpga.tools.recordings.recover import recover

BIG = 300 << 20
PEAK = 150e6
LONG_S = 60.0


def inside(one):
    return Unpacker(FREE).inside(one)


def record(one):
    builder = RecordBuilder()
    one.write(builder)
    return builder.end()


def packed(compression, size):
    """A message of zeros, packed without ever holding it."""
    head = struct.pack("<BQHIQQ", Opcode.MESSAGE, size - 9, 0, 0, 5, 5)
    pieces = [head, *[bytes(1 << 20)] * ((size - len(head)) >> 20), bytes((size - len(head)) & 0xFFFFF)]
    if compression == "zstd":
        # With no size in its head, as whoever packs a stream does not know it.
        packer = zstandard.ZstdCompressor(write_content_size=False).compressobj()
        return b"".join(map(packer.compress, pieces)) + packer.flush()
    if compression == "lz4":
        packer = lz4.frame.LZ4FrameCompressor()
        return packer.begin() + b"".join(map(packer.compress, pieces)) + packer.flush()
    return b"".join(pieces)


def chunk(compression, size, declared=None, data=None):
    data = packed(compression, size) if data is None else data
    return Chunk(compression, data, 5, 5, 0, size if declared is None else declared)


def mcap(chunks, links=("a",), texts=(), repeat=1, in_summary=()):
    """A closed file of these chunks, each named ``repeat`` times at its end."""
    schema = Schema(1, b"", "ros2msg", KIND)
    channels = [Channel(number, f"/{number}", "cdr", {"link": link}, 1) for number, link in enumerate(links)]
    body, index = MAGIC + record(Header("ros2", "x")), b""
    for one in texts:
        data = record(one)
        index += record(MetadataIndex(len(data), len(body), one.name))
        body += data
    for one in chunks:
        data = record(one)
        index += repeat * record(
            ChunkIndex(len(data), len(body), one.compression, len(one.data), 5, 0, {0: 1}, 5, one.uncompressed_size)
        )
        body += data
    body += record(DataEnd(0))
    end = record(schema) + b"".join(map(record, channels)) + index + b"".join(map(record, in_summary))
    end += record(Statistics(0, len(channels), {}, repeat * len(chunks), 1, 5, 5, len(texts), 1))
    return body + end + record(Footer(len(body), 0, 0)) + MAGIC


def tiny(count):
    """A chunk of the smallest records, of a kind that nobody knows."""
    return chunk("zstd", count * 9, data=zstandard.compress((b"\x7f" + bytes(8)) * count))


BOMBS = {
    "zstd": lambda: mcap([chunk("zstd", BIG)]),
    "lz4": lambda: mcap([chunk("lz4", BIG)]),
    "zstd that says little": lambda: mcap([chunk("zstd", BIG, 1000)]),
    "lz4 that says little": lambda: mcap([chunk("lz4", BIG, 1000)]),
    "zstd that says all": lambda: mcap([chunk("zstd", 1000, BIG)]),
    "one chunk many times": lambda: mcap([chunk("zstd", 1 << 23)], repeat=100),
    "many chunks": lambda: mcap([chunk("zstd", 1 << 23)] * 60),
}


@pytest.mark.parametrize("name", BOMBS)
def test_a_bomb_is_refused_by_all_that_read_it(tmp_path, name):
    path = tmp_path / "bomb.mcap"
    path.write_bytes(BOMBS[name]())
    assert path.stat().st_size < 2_000_000
    tracemalloc.start()
    try:
        for use in (
            lambda: list(Recording(path).frames()),
            lambda: list(Recording(path).raw_bytes()),
            lambda: list(Recording(path).frames(1.0)),
            lambda: Recording(path).skins,
            lambda: contactfpga.open(f"replay://{path}", timeout=1).read(),
            lambda: contactfpga.open(f"replay://{path}?pace=1000", timeout=1).read(),
        ):
            with pytest.raises(contactfpga.ContactFPGAError):
                use()
        # What is within the limits is kept.
        with contextlib.suppress(contactfpga.ContactFPGAError):
            found = recover(path)
            assert found.messages < 20
            found.path.unlink()
        assert tracemalloc.get_traced_memory()[1] < PEAK
    finally:
        tracemalloc.stop()
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("use", [lambda path: list(Recording(path).raw_bytes()), recover])
def test_very_many_small_records_are_not_all_looked_at(tmp_path, use):
    """Each takes time, and what packs them well holds millions in a small file."""
    path = tmp_path / "bomb.mcap"
    path.write_bytes(mcap([tiny(14_000)] * 50))
    assert path.stat().st_size < 20_000
    with pytest.raises(RecordingError, match=r"unpacks to more than \d+ MiB|pieces above 64 MiB, or beyond"):
        use(path)


def test_a_bomb_at_the_end_of_a_file_is_passed_over(tmp_path):
    """The library's reader unpacks it to find the file's pieces."""
    path = tmp_path / "x.mcap"
    path.write_bytes(mcap([chunk("zstd", 1000)], in_summary=[chunk("zstd", BIG)]))
    tracemalloc.start()
    try:
        assert list(Recording(path).raw_bytes()) == [(0.0, b"")]
        assert recover(path).messages == 1
        assert tracemalloc.get_traced_memory()[1] < PEAK
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize("compression", ["zstd", "lz4", ""])
@pytest.mark.parametrize("size", [100, 5_000, LARGEST])
def test_a_chunk_within_the_limits_is_read(compression, size):
    (found,) = map(parsed, inside(chunk(compression, size)))
    assert isinstance(found, Message)
    assert found.data == bytes(size - 31)


def test_an_unknown_way_to_pack_is_damaged():
    with pytest.raises(Unreadable):
        list(inside(Chunk("xz", b"", 0, 0, 0, 0)))


@pytest.mark.parametrize("links", [[str(number) for number in range(MAX_LINKS + 1)], ["x" * (MAX_NAME + 1)]])
def test_too_many_links_or_names_too_long_are_reported(tmp_path, links):
    """Each link is read on its own, and its name stands in each row of a table."""
    path = tmp_path / "x.mcap"
    path.write_bytes(mcap([chunk("zstd", 1000)], links))
    with pytest.raises(RecordingError, match=f"{len(links)} links, the longest name {len(links[-1])} characters"):
        Recording(path)


def test_bytes_without_an_end_of_a_packet_are_no_packet(tmp_path):
    """Each more byte took a copy of all before it."""
    path = tmp_path / "x.mcap"
    written(path, {"a": b"\1" * 2_000_000})
    begun_s = time.thread_time()
    with pytest.raises(contactfpga.ContactFPGAError):
        contactfpga.open(f"replay://{path}?pace=1", timeout=LONG_S)
    assert time.thread_time() - begun_s < 10


def test_very_many_texts_are_refused(tmp_path):
    path = tmp_path / "x.mcap"
    texts = [Metadata("contactfpga", {"link": str(number)}) for number in range(MAX_TEXTS + 1)]
    path.write_bytes(mcap([chunk("zstd", 1000)], texts=texts))
    with pytest.raises(RecordingError, match=f"has {MAX_TEXTS + 1:,} texts; the limit is {MAX_TEXTS:,}"):
        Recording(path)


def test_a_long_recording_is_read_a_chunk_at_a_time(tmp_path):
    """The library's reader keeps every chunk that it will hand out."""
    path = tmp_path / "long.mcap"
    port = StreamPort(Skin(), frames=5_000)
    with Session(path, bytes_only=True) as session:
        session.add(port)
        session.start()
        wait_until(lambda: session.wait(0.005) or not port.left)
    whole = sum(len(data) for _, data in Recording(path).raw_bytes())
    assert whole > 90_000
    tracemalloc.start()
    try:
        assert sum(len(data) for _, data in Recording(path).raw_bytes()) == whole
        assert tracemalloc.get_traced_memory()[1] < whole
    finally:
        tracemalloc.stop()
