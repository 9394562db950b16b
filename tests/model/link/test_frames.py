"""Frames: bytes by hand, every message there and back, and no damage that passes for a message."""

import zlib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sosmith.model.link.frames import Message, Receiver, decoded
from sosmith.model.link.protocol import MAX_BODY, MAX_MESSAGE, Counter

MESSAGES = st.builds(Message, st.integers(0, 255), st.integers(0, 255), st.binary(max_size=MAX_BODY))


def test_a_frame_by_hand() -> None:
    crc = zlib.crc32(b"\x03\x00\x00\xff")
    assert crc == 0x1EF39F7F  # without a zero byte in it
    assert Message(3, 0, b"\x00\xff").frame.hex(" ") == "00 02 03 01 06 ff 7f 9f f3 1e 00"


def test_a_frame_has_no_zero_byte_inside_and_one_byte_more_than_its_message() -> None:
    for body in (b"", bytes(MAX_BODY), b"\xff" * MAX_BODY):
        message = Message(0, 0, body)
        inside = message.frame[1:-1]
        assert 0 not in inside
        assert len(inside) == len(message.checked) + 1
    assert len(message.checked) == MAX_MESSAGE


def test_a_body_has_a_limit() -> None:
    with pytest.raises(ValueError, match=r"^body must have at most 242 bytes, not 243$"):
        Message(3, 0, bytes(243))


@given(st.lists(MESSAGES, max_size=4), st.integers(1, 300))
def test_messages_arrive_however_the_stream_is_cut(messages: list[Message], size: int) -> None:
    stream = b"".join(message.frame for message in messages)
    receiver = Receiver()
    found = [each for start in range(0, len(stream), size) for each in receiver.feed(stream[start : start + size])]
    assert found == messages


@given(MESSAGES, st.data())
def test_a_damaged_byte_is_found(message: Message, data: st.DataObject) -> None:
    frame = bytearray(message.frame)
    place = data.draw(st.integers(1, len(frame) - 2))
    frame[place] ^= data.draw(st.integers(1, 255))
    assert message not in Receiver().feed(bytes(frame))


@given(st.binary(max_size=600), MESSAGES)
def test_after_arbitrary_bytes_the_next_frame_arrives(noise: bytes, message: Message) -> None:
    assert Receiver().feed(noise + message.frame)[-1] == message


@pytest.mark.parametrize(
    ("encoded", "counter"),
    [
        (b"\x05\x01", Counter.MALFORMED),  # the block is not complete
        (b"\x06\x01\x02\x03\x04\x05", Counter.MALFORMED),  # five bytes are too few
        (b"\x07" + bytes(range(1, 7)), Counter.CRC),
        (b"\x01" * 250, Counter.MALFORMED),  # 249 bytes are too many
        (b"\x01" * 249, Counter.CRC),
    ],
)
def test_what_is_wrong_with_a_frame(encoded: bytes, counter: Counter) -> None:
    assert decoded(encoded) is counter
    assert Receiver().feed(encoded + b"\0") == [counter]


def test_a_frame_without_an_end_is_one_fault() -> None:
    receiver = Receiver()
    assert receiver.feed(b"\x01" * 100_000) == []
    assert receiver.feed(b"\x01" * 100_000 + b"\0") == [Counter.MALFORMED]
