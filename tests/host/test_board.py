"""The client: results equal to the integer model's, whatever the line does, and errors that say what is wrong."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.host.lines import BadLine, ScriptedLine, device_of, plain_device
from tests.interface.small import filter_design, instrument_design

import sosmith
from sosmith.host.board import Board
from sosmith.host.rows import rows
from sosmith.model.errors import LinkError
from sosmith.model.link.device import Device
from sosmith.model.link.frames import Message, Receiver
from sosmith.model.link.integer_core import IntegerCore
from sosmith.model.link.protocol import Counter, Status, Type
from sosmith.sim.virtual_board.line_damage import LineDamage


def random_codes(design: sosmith.Design, samples: int, seed: int = 1) -> np.ndarray:  # type: ignore[type-arg]
    rng = np.random.default_rng(seed)
    ports = design.core.datapath.inputs
    shape = (samples, design.core.spec.channels)
    return np.stack([rng.integers(p.lowest, p.highest + 1, shape) for p in ports], axis=-1)


@pytest.mark.parametrize("window", [2, 8])
@pytest.mark.parametrize("design", [filter_design, instrument_design], ids=lambda made: made.__name__)
def test_results_are_those_of_the_model(design, window: int) -> None:  # type: ignore[no-untyped-def]
    made = design()
    codes = random_codes(made, 500)
    with Board.on(BadLine(device_of(made, window))) as board:
        results = board.run_codes(codes)
        assert board.faults == {"damaged": 0, "unexpected": 0, "gaps": 0, "timeouts": 0}
    expected, status = made.core.datapath.compute(codes), made.core.datapath.compute_status(codes)
    if made.core.spec.channels == 1:
        expected, status = expected[:, 0], status[:, 0]
    assert np.array_equal(results.codes, expected)
    assert np.array_equal(results.status, status)
    assert np.array_equal(results.values, made.core.datapath.output.decode(expected))


class Asked(Device):
    """A board that packs, and remembers the types of requests."""

    def __init__(self, design: sosmith.Design) -> None:
        plain = device_of(design)
        super().__init__(plain._identity.model_copy(update={"packed": tuple(range(7))}), plain._core)
        self.asked: list[int] = []

    def _carried_out(self, request: Message) -> tuple[bytes, Status]:
        self.asked.append(request.type)
        return super()._carried_out(request)


def test_packed_results_are_those_of_the_model() -> None:
    made = instrument_design()
    codes = random_codes(made, 500)
    device = Asked(made)
    with Board.on(BadLine(device)) as board:
        results = board.run_codes(codes)
        assert board.faults["damaged"] == 0
    assert np.array_equal(results.codes, made.core.datapath.compute(codes))
    assert np.array_equal(results.status, made.core.datapath.compute_status(codes))
    assert (device.asked.count(Type.SAMPLES), device.asked.count(Type.SAMPLES_PACKED)) == (0, -(-1000 // 60))


def test_physical_values_as_in_a_design() -> None:
    made = instrument_design()
    voltage = np.linspace(0, 10, 50)
    with Board.on(BadLine(device_of(made))) as board:
        results = board.run(voltage=voltage, temperature=20.0)
    assert np.array_equal(results.values, made.run(voltage=np.stack([voltage, voltage], 1), temperature=20.0))
    assert results.flag("input_at_rail")[:, 0].tolist() == [True] + [False] * 48 + [True]


def test_the_filter_goes_on_between_calls_and_starts_anew_with_a_session() -> None:
    made, device = filter_design(), plain_device()
    codes = random_codes(made, 90)
    expected = made.core.datapath.compute(codes)[:, 0]
    with Board.on(BadLine(device)) as board:
        parts = [board.run_codes(codes[:35]).codes, board.run_codes(codes[35:]).codes]
    assert np.array_equal(np.concatenate(parts), expected)
    with Board.on(BadLine(device)) as board:
        assert np.array_equal(board.run_codes(codes[:10]).codes, expected[:10])


def test_what_the_board_says_that_it_is() -> None:
    line = BadLine(device_of(instrument_design()))
    with Board.on(line) as board:
        about = board.identity
    assert (about.name, about.channels, about.sample_rate) == ("gauge", 2, 100.0)
    assert [port.name for port in about.input_ports] == ["voltage", "temperature"]
    assert (about.output_port.name, about.output_port.unit) == ("clearance", "mm")
    assert line.closed


@pytest.mark.parametrize("seed", range(3))
def test_a_damaged_line_costs_time_but_no_sample(seed: int) -> None:
    made = filter_design()
    damage = LineDamage(300, seed)
    line = BadLine(plain_device(), damage)
    codes = random_codes(made, 4000)
    with Board.on(line) as board:
        results = board.run_codes(codes)
        faults, counters = board.faults, board.counters()
    assert np.array_equal(results.codes, made.core.datapath.compute(codes)[:, 0])
    assert damage.count > 20
    assert faults["damaged"] + faults["gaps"] + faults["timeouts"] > 10
    assert faults["timeouts"] > 0
    assert line.device.counters[Counter.REPEATED] > 0
    assert line.device.counters[Counter.CRC] + line.device.counters[Counter.MALFORMED] > 5
    assert counters["refused"] == 0


def test_after_a_timeout_only_the_oldest_request_is_sent_again_and_nothing_new() -> None:
    made = filter_design()
    line = ForgetfulLine(plain_device(), forgets=4)
    codes = random_codes(made, 80 * 10)
    with Board.on(line) as board:
        opened = len(line.sent)
        results = board.run_codes(codes)
        assert board.faults == {"damaged": 0, "unexpected": 0, "gaps": 0, "timeouts": 4}
    assert np.array_equal(results.codes, made.core.datapath.compute(codes)[:, 0])
    first = line.sent[opened - 1] + 1
    lost = first + 4
    assert line.sent[opened:] == [*range(first, lost + 4), *range(lost, first + 10)]


class ForgetfulLine(BadLine):
    """A line that loses one frame with samples, after `forgets` others, and remembers the numbers of all frames."""

    def __init__(self, device: Device, *, forgets: int) -> None:
        super().__init__(device)
        self.sent: list[int] = []
        self._left = forgets

    def write(self, data: bytes) -> None:
        (message,) = Receiver().feed(data)
        assert isinstance(message, Message)
        self.sent.append(message.sequence)
        self._left -= message.type == Type.SAMPLES
        if self._left != -1 or message.type != Type.SAMPLES:
            super().write(data)


@pytest.mark.slow
def test_two_hundred_thousand_frames_over_a_damaged_line() -> None:
    made = filter_design()
    device = plain_device()
    line = BadLine(device, LineDamage(1000, 7))
    codes = random_codes(made, 100_000 * 80)  # so many requests, and as many responses
    with Board.on(line) as board:
        results = board.run_codes(codes)
    assert np.array_equal(results.codes, made.core.datapath.compute(codes)[:, 0])
    assert device.counters[Counter.OVERRUN] == 0


def test_counters_go_on_where_bytes_wrap_around() -> None:
    device = plain_device()
    with Board.on(BadLine(device)) as board:
        device.counters[Counter.CRC] = 250
        assert board.counters()["crc"] == 0
        device.counters[Counter.CRC] = 4
        device.counters[Counter.FRAMING] = 3
        counted = board.counters()
    assert (counted["crc"], counted["framing"]) == (10, 3)


@given(st.lists(st.binary(max_size=300), max_size=20))
def test_arbitrary_bytes_from_the_board_end_in_a_typed_error(script: list[bytes]) -> None:
    line = ScriptedLine(*script)
    with pytest.raises(sosmith.LinkError):
        Board.on(line)
    assert line.closed


FRAMES = st.builds(
    lambda kind, sequence, body: Message(kind, sequence, body).frame,
    st.integers(0x81, 0x83),
    st.integers(0, 4),
    st.one_of(st.binary(max_size=12), st.sampled_from([bytes([1, 4, 0]), b'{"protocol":1}\0' + bytes(51)])),
)


@given(st.lists(FRAMES, max_size=40))
def test_frames_that_make_no_sense_end_in_a_typed_error(script: list[bytes]) -> None:
    with pytest.raises(sosmith.LinkError):
        Board.on(ScriptedLine(Message(0x81, 0, bytes([1, 4, 0])).frame, *script))


@pytest.mark.slow
@given(st.lists(st.one_of(FRAMES, st.binary(max_size=99)), max_size=40))
def test_between_good_responses_nonsense_changes_nothing(noise: list[bytes]) -> None:
    made = filter_design()
    codes = random_codes(made, 200)
    pieces = iter(noise)

    def damage(data: bytes) -> bytes:
        # Frames of the board's own numbers could be taken for its own: only those of other types are mixed in.
        return data + next(pieces, b"").replace(b"\x83", b"\x99")

    line = BadLine(plain_device())
    with Board.on(line) as board:
        line.damage = damage
        assert np.array_equal(board.run_codes(codes).codes, made.core.datapath.compute(codes)[:, 0])


def test_a_board_that_is_silent() -> None:
    with pytest.raises(sosmith.LinkLostError, match=r"^the board must answer, not be silent after 6 attempts$"):
        Board.on(ScriptedLine())


def test_a_board_of_another_version() -> None:
    with pytest.raises(
        sosmith.LinkError, match=r"^the board must speak version 1 of the protocol, not answer with 02 04$"
    ):
        Board.on(ScriptedLine(Message(0x81, 0, bytes([2, 4, 0])).frame))


def test_an_identity_without_end() -> None:
    blocks = [Message(0x82, n, b"x" * 64 + b"\0").frame for n in range(1, 17)]
    with pytest.raises(sosmith.LinkError, match=r"^the board's identity must end within 1024 bytes$"):
        Board.on(ScriptedLine(Message(0x81, 0, bytes([1, 4, 0])).frame, *blocks))


def test_an_identity_that_is_none() -> None:
    block = Message(0x82, 1, b'{"protocol":1}' + bytes(50) + b"\0").frame
    expected = r"^the board's identity must be the JSON of docs/protocol.md, not: name: Field required$"
    with pytest.raises(sosmith.LinkError, match=expected):
        Board.on(ScriptedLine(Message(0x81, 0, bytes([1, 4, 0])).frame, block))


def test_what_the_board_refuses() -> None:
    with Board.on(BadLine(plain_device())) as board:
        with pytest.raises(
            sosmith.RefusedError, match=r"^the board must carry out READ, not answer: the device has no such request"
        ):
            board.read_register(0)
        with pytest.raises(sosmith.RefusedError, match=r"^the board must carry out POLL, not answer: "):
            board.poll()
        assert board.counters()["refused"] == 0  # it counts from its first call


@pytest.mark.parametrize(
    ("codes", "message"),
    [
        (np.zeros((3, 2), int), "codes must have the shape (samples, 1, 1), not (3, 2)"),
        (np.zeros((3, 1)), "codes must be integers, not float64"),
        (np.full((3, 1), 512), "codes of x must be in -512..511, not 512..512"),
    ],
)
def test_codes_that_do_not_fit(codes: np.ndarray, message: str) -> None:  # type: ignore[type-arg]
    with Board.on(BadLine(plain_device())) as board, pytest.raises(sosmith.SpecificationError) as caught:
        board.run_codes(codes)
    assert str(caught.value) == message


def test_inputs_that_do_not_fit() -> None:
    with Board.on(BadLine(plain_device())) as board:
        with pytest.raises(sosmith.SpecificationError, match=r"^the inputs must be x, not y$"):
            board.run(y=1)
        with pytest.raises(sosmith.SpecificationError, match=r"^the inputs must have the shape \(samples,\) or "):
            board.run(x=1.0)


def test_a_port_that_does_not_exist() -> None:
    expected = r"^/nowhere must be a serial port that is free, not: No such file or directory$"
    with pytest.raises(sosmith.ToolError, match=expected):
        Board("/nowhere")


class StrayLine(BadLine):
    """A line to a board that sets bits of its results, of some of the first responses with samples or of all."""

    def __init__(self, device: Device, place: int, bits: int, times: int) -> None:
        super().__init__(device)
        self._place, self._bits, self._times = place, bits, times

    def read(self, timeout: float) -> bytes:
        found = [each for each in Receiver().feed(super().read(timeout)) if isinstance(each, Message)]
        return b"".join(self._changed(each).frame for each in found)

    def _changed(self, message: Message) -> Message:
        if message.type != Type.SAMPLES | 0x80 or not self._times:
            return message
        self._times -= 1
        body = bytearray(message.body)
        body[self._place] ^= self._bits
        return Message(message.type, message.sequence, bytes(body))


STRAY = [(1, 0x40), (1, 0x80), (1, 0x10), (2, 0x80)]
"""A bit of the code's extension to whole bytes, and one that is no flag's."""


@pytest.mark.parametrize(("place", "bits"), STRAY)
def test_bits_outside_of_their_field_are_damage_and_are_asked_for_again(place: int, bits: int) -> None:
    made = filter_design()
    codes = random_codes(made, 300)
    with Board.on(StrayLine(plain_device(), place, bits, 2)) as board:
        assert np.array_equal(board.run_codes(codes).codes, made.core.datapath.compute(codes)[:, 0])
        assert board.faults["damaged"] == 2


@pytest.mark.parametrize(("place", "bits"), STRAY)
def test_a_board_whose_results_are_always_damaged_is_given_up(place: int, bits: int) -> None:
    expected = r"^the board must answer SAMPLES with values within their fields, not 3 times with bits outside of them$"
    with Board.on(StrayLine(plain_device(), place, bits, -1)) as board:
        with pytest.raises(sosmith.LinkError, match=expected):
            board.run_codes(random_codes(filter_design(), 3))
        assert board.faults["damaged"] == 3


def test_bits_of_a_flag_are_no_damage() -> None:
    with Board.on(StrayLine(plain_device(), 2, 0x40, -1)) as board:
        assert board.run_codes(random_codes(filter_design(), 3)).flag("fault")[0]
        assert board.faults["damaged"] == 0


def test_blocks_of_an_identity_are_whole() -> None:
    block = Message(0x82, 1, b"{" + b"\0").frame
    expected = r"^the board's identity must come in blocks of 64 bytes, not 1$"
    with pytest.raises(sosmith.LinkError, match=expected):
        Board.on(ScriptedLine(Message(0x81, 0, bytes([1, 4, 0])).frame, block))


def test_a_response_has_a_result_for_each_sample() -> None:
    class ShortLine(StrayLine):
        def _changed(self, message: Message) -> Message:
            wrong = message.type == Type.SAMPLES | 0x80
            return Message(message.type, message.sequence, message.body[3:]) if wrong else message

    with (
        Board.on(ShortLine(plain_device(), 0, 0, 0)) as board,
        pytest.raises(sosmith.LinkError, match=r"^the board must return 80 results, not 79$"),
    ):
        board.run_codes(random_codes(filter_design(), 100))


class Several:
    """A core with three results for each sample: that of its channel, and twice more."""

    def __init__(self, made: sosmith.Design) -> None:
        self.channels = made.core.spec.channels
        self.inner = IntegerCore(made.core.datapath, self.channels)

    def reset(self) -> None:
        self.inner.reset()

    def feed(self, channel: int, samples: bytes) -> bytes:
        results = self.inner.feed(channel, samples)
        size = len(results) // (len(samples) // 4)
        rows = [results[start : start + size] for start in range(0, len(results), size)]
        return b"".join(row[:-1] + bytes([flag]) for row in rows for flag in (0, 1, 4))

    def read(self, address: int) -> int | None:
        return None

    def write(self, address: int, word: int) -> bool:
        return False


def test_several_results_for_each_sample_come_in_the_order_of_time() -> None:
    made = instrument_design()
    codes = random_codes(made, 50)
    about = device_of(made)._identity.model_copy(update={"results": 3, "samples": 26, "packed": None})
    line = BadLine(Device(about, Several(made)))
    with Board.on(line) as board:
        results = board.run_codes(codes)
    expected = made.core.datapath.compute(codes)
    assert np.array_equal(results.codes, np.repeat(expected, 3, axis=0))
    assert results.status.tolist() == [[flag, flag] for _ in range(50) for flag in (0, 1, 4)]
    times = [row[0] for row in rows(board.identity, results)]
    assert times[:8] == [n / 300 for n in (0, 0, 1, 1, 2, 2, 3, 3)]


def test_a_board_with_fewer_results_than_it_says_is_refused() -> None:
    made = filter_design()
    about = device_of(made)._identity.model_copy(update={"results": 2, "samples": 40, "packed": None})
    with (
        Board.on(BadLine(Device(about, IntegerCore(made.core.datapath)))) as board,
        pytest.raises(LinkError, match=r"^the board must return 6 results, not 3$"),
    ):
        board.run_codes(random_codes(made, 3))
