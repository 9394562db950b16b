"""The model of the board: sessions, sequence numbers, every status and every counter, samples of several channels."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.interface.small import filter_design, instrument_design

import sosmith
from sosmith.gen.output.identity import identity
from sosmith.model.link.device import Device
from sosmith.model.link.frames import Message, Receiver
from sosmith.model.link.identity import Identity
from sosmith.model.link.integer_core import IntegerCore
from sosmith.model.link.protocol import RESPONSE, Counter, Status, Type

OPEN = Message(Type.OPEN, 0)


def device(design: sosmith.Design, window: int = 4) -> Device:
    core = design.core
    made = identity(core, "", baud=1_000_000, clock=12e6)
    return Device(made, IntegerCore(core.datapath, core.spec.channels), window=window)


def ask(board: Device, *messages: Message) -> list[Message]:
    """Send messages, one after another; return the responses."""
    found = Receiver().feed(b"".join(board.feed(message.frame) for message in messages))
    return [each for each in found if isinstance(each, Message)]


def test_a_session_begins_with_version_and_window() -> None:
    (response,) = ask(device(filter_design(), 8), OPEN)
    assert response == Message(Type.OPEN | RESPONSE, 0, bytes([1, 8, Status.OK]))


def test_the_identity_is_read_block_by_block() -> None:
    board = device(filter_design())
    blocks = ask(board, OPEN, *(Message(Type.IDENTITY, 1 + n, bytes([n])) for n in range(16)))[1:]
    text = b"".join(block.body[:-1] for block in blocks)
    found = Identity.of_memory(text)
    assert (found.name, found.inputs) == ("plain", (("x", 10, True, 0.0, 1 / 512, ""),))
    assert found.input_ports[0].lowest == -512
    assert text.startswith(found.memory)


@given(st.lists(st.integers(1, 30), min_size=1, max_size=8), st.integers(0, 1), st.randoms(use_true_random=False))
@settings(max_examples=20)
def test_samples_in_messages_of_any_length_give_the_results_of_the_model(sizes, first, random) -> None:  # type: ignore[no-untyped-def]
    core = instrument_design().core
    board = IntegerCore(core.datapath, 2)
    count = sum(sizes)
    rng = np.random.default_rng(random.getrandbits(32))
    codes = np.stack([rng.integers(0, 4096, count), rng.integers(0, 1024, count)], axis=1)
    samples = codes.astype("<u2").tobytes()
    received, start = b"", 0
    for size in sizes:
        received += board.feed((first + start) % 2, samples[4 * start : 4 * (start + size)])
        start += size
    found = np.frombuffer(received, np.uint8).reshape(-1, 3).astype(np.int64)
    for channel in range(2):
        own = slice((channel - first) % 2, None, 2)
        if len(codes[own]):
            assert np.array_equal(found[own, 0] + 256 * found[own, 1], core.datapath.compute(codes[own]))
            assert np.array_equal(found[own, 2], core.datapath.compute_status(codes[own]))


def test_bits_beyond_a_code_are_ignored() -> None:
    core = filter_design().core
    assert IntegerCore(core.datapath).feed(0, b"\xff\xfd") == IntegerCore(core.datapath).feed(0, b"\xff\x01")


def test_opening_resets_the_core() -> None:
    board = device(filter_design())
    samples = Message(Type.SAMPLES, 1, bytes([0, 100, 0, 100, 0]))
    _, first = ask(board, OPEN, samples)
    assert first.body[:-1] != bytes(len(first.body) - 1)
    assert ask(board, OPEN, samples)[1] == first


def test_a_request_that_comes_again_is_answered_again_with_all_later_ones() -> None:
    board = device(filter_design(), 2)
    requests = [Message(Type.SAMPLES, n, bytes([0, 100, 0])) for n in (1, 2, 3)]
    _, *responses = ask(board, OPEN, *requests)
    assert ask(board, requests[1]) == responses[1:]
    assert ask(board, requests[2]) == responses[2:]
    assert board.counters[Counter.REPEATED] == 2
    assert ask(board, requests[0]) == []  # no longer retained
    assert ask(board, Message(Type.COUNTERS, 5)) == []  # number 4 is missing
    assert board.counters[Counter.SEQUENCE] == 2


def test_before_the_first_session_there_is_no_answer() -> None:
    board = device(filter_design())
    assert ask(board, Message(Type.COUNTERS, 0), Message(Type.SAMPLES, 255)) == []
    assert board.counters[Counter.SEQUENCE] == 2


def test_a_session_may_begin_with_any_number() -> None:
    responses = ask(device(filter_design()), Message(Type.OPEN, 77), Message(Type.COUNTERS, 78))
    assert [response.sequence for response in responses] == [77, 78]


def test_sequence_numbers_wrap_around() -> None:
    board = device(filter_design())
    responses = ask(board, OPEN, *(Message(Type.COUNTERS, n % 256) for n in range(1, 600)))
    assert [response.sequence for response in responses] == [n % 256 for n in range(600)]


@pytest.mark.parametrize(
    ("kind", "body", "status", "content"),
    [
        (Type.IDENTITY, b"", Status.LENGTH, b""),
        (Type.COUNTERS, b"\0", Status.LENGTH, b""),
        (Type.SAMPLES, b"", Status.LENGTH, b""),
        (Type.SAMPLES, b"\0", Status.OK, b""),
        (Type.SAMPLES, b"\0" + bytes(3), Status.LENGTH, bytes(3)),
        (Type.SAMPLES, b"\0" + bytes(2 * 81), Status.LENGTH, b""),
        (Type.SAMPLES, b"\1\0\0", Status.CHANNEL, b""),
        (Type.POLL, b"", Status.UNKNOWN, b""),
        (Type.READ, b"\0", Status.UNKNOWN, b""),
        (Type.WRITE, b"\0\0\0\0\0", Status.UNKNOWN, b""),
        (0, b"", Status.UNKNOWN, b""),
        (0x77, b"", Status.UNKNOWN, b""),
        (0xF3, b"", Status.UNKNOWN, b""),
    ],
)
def test_what_becomes_of_a_request(kind: int, body: bytes, status: Status, content: bytes) -> None:
    board = device(filter_design())
    _, response = ask(board, OPEN, Message(kind, 1, body))
    assert response == Message(kind | RESPONSE, 1, content + bytes([status]))
    assert board.counters[Counter.REFUSED] == (status is not Status.OK)


def test_faults_are_counted_and_counts_wrap_around() -> None:
    board = device(filter_design())
    damaged = Message(Type.OPEN, 0, b"\1").frame.replace(b"\1", b"\2")
    assert board.feed(damaged * 258 + b"\1\0") == b""
    assert board.counters[Counter.CRC] == 2
    assert board.counters[Counter.MALFORMED] == 1


@given(
    st.lists(
        st.one_of(
            st.binary(max_size=300),
            st.builds(
                lambda t, s, b: Message(t, s, b).frame, st.integers(0, 9), st.integers(0, 3), st.binary(max_size=9)
            ),
        )
    )
)
@settings(max_examples=100)
def test_arbitrary_bytes_never_wedge_the_board(parts: list[bytes]) -> None:
    board = device(filter_design())
    board.feed(b"".join(parts))
    assert ask(board, OPEN)[-1].body == bytes([1, 4, Status.OK])


def test_the_window_is_one_of_a_few() -> None:
    with pytest.raises(ValueError, match=r"^window must be one of 2, 4, 8, 16, not 3$"):
        device(filter_design(), 3)


def test_packed_results_are_the_same_results() -> None:
    plain = device(filter_design())
    identity = plain._identity.model_copy(update={"packed": (0, 2)})
    packing = identity.packing
    assert packing is not None
    board = Device(identity, plain._core)
    samples = bytes(range(80))
    _, response = ask(plain, OPEN, Message(Type.SAMPLES, 1, b"\0" + samples))
    _, packed = ask(board, OPEN, Message(Type.SAMPLES_PACKED, 1, b"\0" + samples))
    assert packing.plain(packed.body[:-1]) == response.body[:-1]
    assert len(packed.body) < len(response.body)
    _, refused = ask(plain, OPEN, Message(Type.SAMPLES_PACKED, 1, b"\0" + samples))
    assert refused.body == bytes([Status.UNKNOWN])
