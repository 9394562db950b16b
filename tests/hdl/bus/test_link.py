# amaranth: UnusedElaboratable=no
"""The link in hardware against the model of the board's end: every byte of every response, and every counter."""

import random
import re
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path

import pytest
from tests.hdl.bus.line_bench import Line, built
from tests.interface.small import filter_design

import sosmith
from sosmith.gen.output.board_top import board_top, board_verilog, top_name
from sosmith.gen.output.identity import identity
from sosmith.gen.output.verilog import core_verilog
from sosmith.hdl.bus.command_engine import WINDOW, CommandEngine, Face
from sosmith.model.errors import SpecificationError
from sosmith.model.link.device import Device
from sosmith.model.link.frames import Message, Receiver
from sosmith.model.link.identity import Identity
from sosmith.model.link.integer_core import IntegerCore
from sosmith.model.link.protocol import Counter, Status, Type
from sosmith.model.reload.registers import DATA, DESIGN, ID, MAGIC, STATUS, VERSION

CLOCK, RATE = Fraction(12_000_000), 3_000_000
RATIO = CLOCK / RATE
SILENCE = 9_000
"""Clocks without a byte after which no response is expected any more; the longest request takes less."""
SPEC = {
    "name": "three",
    "sample_rate": 32_000,
    "channels": 3,
    "input": {"x": {"bits": 12, "range": [-1.0, 1.0], "signed": True}},
    "filter": {"family": "butterworth", "kind": "lowpass", "order": 1, "cutoff": 3200.0},
    "output": {"bits": 12, "range": [-1.0, 1.0], "signed": True},
    "hardware": {"realization": "df1_ef1", "architecture": "parallel", "clock": 12e6, "reload": True},
}


class Both:
    """A board in hardware and its model; both get the same bytes, and must answer the same."""

    def __init__(self, line: Line, design: sosmith.Design) -> None:
        self.line = line
        core = design.core
        text = core_verilog(core)
        self.design = core
        made = identity(core, text, baud=RATE, clock=float(CLOCK))
        self.model = Device(made, IntegerCore(core.datapath, core.spec.channels), window=WINDOW)
        self.samples = made.samples
        self.next = 0

    def send(self, data: bytes) -> list[Message | Counter]:
        expected = self.model.feed(data)
        reply = self.line.call(data, SILENCE)
        assert reply.data.hex() == expected.hex(), (Receiver().feed(reply.data), Receiver().feed(expected))
        return Receiver().feed(reply.data)

    def ask(self, kind: int, body: bytes = b"") -> bytes:
        """Send the next request; return the body of the response."""
        (response,) = self.send(Message(kind, self.next, body).frame)
        assert isinstance(response, Message)
        self.next = (self.next + 1) % 256
        return response.body

    def take_counters(self) -> None:
        """Begin a session, and let the model's counters be those of the hardware."""
        (_, found) = Receiver().feed(
            self.line.call(Message(Type.OPEN, 0).frame + Message(Type.COUNTERS, 1).frame, SILENCE).data
        )
        assert isinstance(found, Message)
        self.model.counters[:] = found.body[: len(Counter)]
        self.open()

    def open(self) -> None:
        self.next = 0
        assert self.ask(Type.OPEN) == bytes([1, WINDOW, Status.OK])


@pytest.fixture(scope="module")
def board(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Both]:
    design = sosmith.design(SPEC)
    program = built(
        board_verilog(design.core, clock=CLOCK, rate=RATE), top_name(design.core), tmp_path_factory.mktemp("board")
    )
    with Line(program, float(RATIO)) as line:
        yield Both(line, design)


@pytest.mark.slow
def test_before_a_session_nothing_is_answered_but_open(board: Both) -> None:
    for number in (0, 1, 255):
        assert board.line.call(Message(Type.COUNTERS, number).frame, SILENCE).data == b""
    board.take_counters()
    assert board.send(Message(Type.COUNTERS, 255).frame) == []
    assert board.ask(Type.COUNTERS)[Counter.SEQUENCE] == 4


def test_the_identity_is_in_the_memory(board: Both) -> None:
    board.open()
    for block in (*range(12), 255):
        board.ask(Type.IDENTITY, bytes([block]))


def test_samples_of_all_channels_give_the_results_of_the_model(board: Both) -> None:
    board.open()
    rng = random.Random(1)
    for count in (1, 2, 3, 7, 80, 5):
        for channel in range(3):
            board.ask(Type.SAMPLES, bytes([channel]) + rng.randbytes(2 * count))


def test_packed_results_of_all_channels_are_those_of_the_model(board: Both) -> None:
    """A rate of 96,000 results a second that 3 Mbaud carry only so."""
    board.open()
    packing = Identity.of_memory(board.model._identity.memory).packing
    assert packing is not None
    assert (packing.bits, packing.per_message(2)) == (19, 101)
    rng = random.Random(4)
    for count in (0, 1, 2, 3, 8, 101, 5):
        body = bytes([count % 3]) + rng.randbytes(2 * count)
        assert len(board.ask(Type.SAMPLES_PACKED, body)) == -(-19 * count // 8) + 1
    assert board.ask(Type.SAMPLES_PACKED, b"\1\2\3\4")[3:] == bytes([Status.LENGTH])
    assert board.ask(Type.SAMPLES_PACKED, b"\0" + bytes(204)) == bytes([Status.LENGTH])
    assert board.ask(Type.SAMPLES_PACKED) == bytes([Status.LENGTH])
    assert board.ask(Type.SAMPLES_PACKED, b"\3\0\0") == bytes([Status.CHANNEL])


def test_a_session_clears_the_states(board: Both) -> None:
    board.open()
    step = b"\0\0" + b"\xff\x07" * 29
    first = board.ask(Type.SAMPLES, b"\0" + step)
    second = board.ask(Type.SAMPLES, b"\0" + step)
    board.open()
    assert board.ask(Type.SAMPLES, b"\0" + step) == first != second


def test_what_cannot_be_carried_out_is_told(board: Both) -> None:
    board.open()
    for kind in (0, Type.POLL, 8, Type.POLL_PACKED, 0x7F, 0x81, 0xFF):
        assert board.ask(kind, b"\0") == bytes([Status.UNKNOWN])
    for kind, body in ((Type.IDENTITY, b""), (Type.IDENTITY, b"\0\0"), (Type.COUNTERS, b"\0"), (Type.SAMPLES, b"")):
        assert board.ask(kind, body) == bytes([Status.LENGTH])
    for body in (b"\3", b"\3\0\0", b"\xff\1\2\3"):
        assert board.ask(Type.SAMPLES, body) == bytes([Status.CHANNEL])
    assert board.ask(Type.SAMPLES, b"\2") == bytes([Status.OK])
    assert board.ask(Type.SAMPLES, b"\2\1\2\3")[3:] == bytes([Status.LENGTH])
    assert board.ask(Type.SAMPLES, b"\2" + bytes(160))[-1] == Status.OK
    assert board.ask(Type.SAMPLES, b"\2" + bytes(162)) == bytes([Status.LENGTH])


def test_a_request_that_comes_again_is_answered_again(board: Both) -> None:
    board.open()
    sample = b"\1\2\3"
    frames = [Message(Type.SAMPLES, number, sample).frame for number in (1, 2, 3)]
    for frame in (frames[0], frames[0], frames[1], frames[1], frames[0], frames[2], frames[0], frames[1], frames[2]):
        board.send(frame)
    board.send(frames[1] + frames[2])
    board.next = 4
    before = board.ask(Type.COUNTERS)
    board.send(Message(Type.COUNTERS, 3).frame)
    assert board.ask(Type.COUNTERS)[Counter.REPEATED] == (before[Counter.REPEATED] + 1) % 256


def test_two_requests_at_once_are_within_the_window(board: Both) -> None:
    board.open()
    for number in range(1, 41, 2):
        frames = [Message(Type.SAMPLES, number + k, b"\0" + bytes(2 * number)).frame for k in (0, 1)]
        assert len(board.send(b"".join(frames))) == 2


def test_more_requests_at_once_than_the_window_are_dropped_and_counted(board: Both) -> None:
    board.open()
    frames = [Message(Type.IDENTITY, number, b"\0").frame for number in range(1, 9)]
    found = Receiver().feed(board.line.call(b"".join(frames), SILENCE).data)
    assert [message.sequence for message in found if isinstance(message, Message)][:2] == [1, 2]
    numbers = [message.sequence for message in found if isinstance(message, Message)]
    assert numbers == list(range(1, 1 + len(numbers)))
    board.take_counters()
    assert 0 < board.model.counters[Counter.OVERRUN] <= 8 - len(numbers)


def test_sequence_numbers_wrap_around(board: Both) -> None:
    board.send(Message(Type.OPEN, 253).frame)
    board.next = 254
    for _ in range(6):
        board.ask(Type.SAMPLES, b"\0\1\2")
    board.send(Message(Type.SAMPLES, 2, b"\0\1\2").frame)
    assert board.next == 4


def test_the_board_survives_any_bytes(board: Both) -> None:
    board.open()
    rng = random.Random(2)
    for _ in range(300):
        noise = bytes(rng.choice([0, 0, 1, 2, 3, rng.randrange(256)]) for _ in range(rng.randrange(1, 20)))
        board.send(b"\0" + noise + b"\0")
    board.ask(Type.COUNTERS)
    for length in (247, 248, 249, 250, 251, 300, 600):
        board.send(b"\0" + bytes([255]) * length + b"\0")
        board.send(b"\0" + bytes([1]) * length + b"\0")
    board.ask(Type.COUNTERS)


def test_a_damaged_frame_takes_no_other_with_it(board: Both) -> None:
    board.open()
    rng = random.Random(3)
    for _ in range(100):
        message = Message(Type.SAMPLES, board.next, b"\0" + rng.randbytes(2 * rng.randrange(1, 20)))
        damaged = bytearray(message.frame)
        place = rng.randrange(len(damaged))
        match rng.randrange(3):
            case 0:
                damaged[place] ^= 1 << rng.randrange(8)
            case 1:
                del damaged[place]
            case _:
                damaged.insert(place, rng.randrange(256))
        board.send(bytes(damaged))
        board.send(message.frame)
        board.next = (board.next + 1) % 256
    board.ask(Type.COUNTERS)


def test_a_byte_without_its_stop_bit_is_counted(board: Both) -> None:
    board.open()
    before = board.ask(Type.COUNTERS)
    assert board.line.call(b"\0\3\2", SILENCE, breaks=True).data == b""
    reply = Receiver().feed(board.line.call(b"\0" + Message(Type.COUNTERS, board.next).frame, SILENCE).data)
    assert isinstance(reply[0], Message)
    assert reply[0].body[Counter.FRAMING] == (before[Counter.FRAMING] + 1) % 256
    assert reply[0].body[Counter.MALFORMED] == (before[Counter.MALFORMED] + 1) % 256
    board.take_counters()


def test_registers_are_read_and_written(board: Both) -> None:
    number = 0

    def ask(kind: Type, body: bytes = b"") -> tuple[bytes, Status]:
        nonlocal number
        (found,) = Receiver().feed(board.line.call(Message(kind, number, body).frame, SILENCE).data)
        number += 1
        assert isinstance(found, Message)
        return found.body[:-1], Status(found.body[-1])

    def read(address: int) -> int:
        word, status = ask(Type.READ, bytes([address]))
        assert (len(word), status) == (4, Status.OK)
        return int.from_bytes(word, "little")

    ask(Type.OPEN)
    assert read(ID.address) == read(ID.address + 3) == MAGIC
    assert read(DESIGN.address) == board.design.architecture.fingerprint
    assert ask(Type.READ, bytes([DATA.address]))[1] is Status.REFUSED
    assert ask(Type.READ) == ask(Type.READ, b"\0\0") == (b"", Status.LENGTH)
    version = bytes([VERSION.address, 7, 0, 0, 0])
    assert ask(Type.WRITE, version) == (b"", Status.OK)
    assert read(STATUS.address) & 1 == 1
    assert ask(Type.WRITE, bytes([DATA.address, 1, 2, 3, 4, 5, 6])) == (b"", Status.LENGTH)
    assert ask(Type.WRITE, bytes([DATA.address]) + bytes(4 * 60)) == (b"", Status.REFUSED)
    assert read(STATUS.address) & 1 == 0
    assert ask(Type.WRITE) == (b"", Status.LENGTH)
    assert ask(Type.WRITE, bytes([ID.address, 1, 2, 3, 4])) == (b"", Status.REFUSED)
    assert ask(Type.SAMPLES, b"\0\0\0") == (b"\0\0\0", Status.OK)
    board.take_counters()


@pytest.mark.slow
def test_a_core_without_registers_knows_no_requests_for_them(tmp_path: Path) -> None:
    design = filter_design()
    program = built(board_verilog(design.core, clock=CLOCK, rate=RATE), top_name(design.core), tmp_path)
    with Line(program, float(RATIO)) as line:
        both = Both(line, design)
        both.open()
        for kind in (Type.READ, Type.WRITE, Type.SAMPLES_PACKED):
            assert both.ask(kind, b"\0") == bytes([Status.UNKNOWN])
        assert both.ask(Type.SAMPLES, b"\1\2\3") == bytes([Status.CHANNEL])
        both.ask(Type.SAMPLES, b"\0" + bytes(2 * 80))


def test_the_link_carries_more_than_four_fifths_of_the_line_rate(board: Both) -> None:
    board.open()
    # What the host does with its credit: a request whenever a response is complete. Here both are always under way.
    count = board.samples
    body = b"\0" + bytes(2 * count)
    frames = b"".join(Message(Type.SAMPLES, 1 + k, body).frame for k in range(2))
    reply = board.line.call(frames, SILENCE)
    assert len(Receiver().feed(reply.data)) == 2
    line_clocks = 10 * float(RATIO) * len(reply.data)
    assert 2 * count * 3 * 10 * float(RATIO) > 0.8 * reply.sending
    assert reply.sending < 1.02 * line_clocks


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            {"clock": Fraction(11_999_999)},
            "the line rate must be at most 3,000,000 baud at a clock of 11,999,999 Hz, not 3,000,000",
        ),
    ],
)
def test_what_does_not_fit_the_link_is_refused(change: dict[str, Fraction], message: str) -> None:
    with pytest.raises(SpecificationError, match=f"^{re.escape(message)}$"):
        board_top(filter_design().core, **{"clock": CLOCK, "rate": RATE, **change})


def test_more_channels_than_a_byte_can_tell_are_refused() -> None:
    message = "channels must be at most 256 over a link, not 257"
    with pytest.raises(SpecificationError, match=f"^{re.escape(message)}$"):
        board_top(sosmith.design({**SPEC, "channels": 257}).core, clock=CLOCK)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Face(sample_bytes=1, result_bytes=1, channels=257), "channels must be 1 to 256, not 257"),
        (lambda: Face(sample_bytes=242, result_bytes=1), "sample_bytes must be 1 to 241, not 242"),
        (
            lambda: CommandEngine(Face(sample_bytes=1, result_bytes=1), bytes(96)),
            "memory must be a power of two from 64 on, not 96 bytes",
        ),
    ],
)
def test_what_the_engine_cannot_be_is_refused(make, message: str) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
        make()
