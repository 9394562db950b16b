"""A client for a board at the end of a serial port."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from os import PathLike
from types import TracebackType
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from sosmith.host.line import Line, SerialLine
from sosmith.host.session import Request, Session
from sosmith.model.converters.spi_converter import ReadingFault
from sosmith.model.errors import LinkError, SpecificationError
from sosmith.model.link.identity import Identity
from sosmith.model.link.packing import bytes_of, codes_of
from sosmith.model.link.protocol import BLOCK_BYTES, MAX_IDENTITY, MAX_WORDS, WORD_BYTES, Counter, Type

if TYPE_CHECKING:
    from sosmith.host.loading import Loaded

Codes = npt.NDArray[np.int64]

BAUD = 1_000_000
"""Rate of the line that boards are built for by default, in bits per second."""


@dataclass(frozen=True, eq=False)
class Results:
    """What a board returned, one row per sample: shape (samples,) for one channel, (samples, channels) for several.

    Attributes
    ----------
    values : ndarray of float
        Results in the unit of the output.
    codes : ndarray of int
        Their codes.
    status : ndarray of uint8
        Status of each result, a bit for each flag.
    flags : dict of str to int
        The bit of each flag, by its name.
    """

    values: npt.NDArray[np.float64] = field(repr=False)
    codes: Codes = field(repr=False)
    status: npt.NDArray[np.uint8] = field(repr=False)
    flags: dict[str, int]

    def flag(self, name: str) -> npt.NDArray[np.bool_]:
        """Tell which results have a flag, such as ``"wear_warning"``; raises KeyError if the board has none of it."""
        return np.asarray(self.status >> self.flags[name] & 1, dtype=np.bool_)


class Board:
    """A board at the end of a serial port, real or virtual, for this process alone.

    Opening it begins a session, which resets a core that is fed over the link; what is damaged or lost on the line is
    asked for again. Use it in a ``with`` statement, which closes the port.

    Parameters
    ----------
    port : str
        Name of the serial port, or the path that `sosmith board SPEC --virtual` prints.
    baud : int
        Bits per second; a virtual board takes any.

    Raises
    ------
    ToolError
        If there is no such port, or another program uses it.
    LinkLostError
        If no board answers.
    LinkError
        If its identity makes no sense, or it speaks another version of the protocol.

    Examples
    --------
    With a board at the end of a port, ``sosmith.Board("/dev/ttyUSB1")`` instead of ``design.board()``:

    >>> import sosmith
    >>> design = sosmith.design({
    ...     "name": "smooth",
    ...     "sample_rate": 1000,
    ...     "input": {"x": {"bits": 12, "range": [-1.0, 1.0], "signed": True}},
    ...     "filter": {"family": "butterworth", "kind": "lowpass", "order": 2, "cutoff": 100.0},
    ...     "output": {"bits": 12, "range": [-1.0, 1.0], "signed": True},
    ... })
    >>> with design.board() as board:
    ...     results = board.run(x=[0.0, 0.5, 1.5])
    ...     board.identity.name, board.counters()["crc"]
    ('smooth', 0)
    >>> results.flag("input_at_rail").tolist()
    [False, False, True]
    """

    def __init__(self, port: str, *, baud: int = BAUD) -> None:
        self._start(SerialLine(port, baud))

    @classmethod
    def on(cls, line: Line) -> Board:
        """Return the board at the end of a line that is open already: anything that can write, read and close."""
        board = cls.__new__(cls)
        board._start(line)
        return board

    def _start(self, line: Line) -> None:
        self._line = line
        self._counted: list[int] | None = None
        self._totals = [0] * len(Counter)
        try:
            self._session = Session(line)
            self._identity = Identity.of_memory(self._memory())
        except BaseException:
            line.close()
            raise

    def __enter__(self) -> Board:
        """Return the board itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close the port."""
        self.close()

    def close(self) -> None:
        """Close the port; the board keeps its coefficients and counters."""
        self._line.close()

    @property
    def identity(self) -> Identity:
        """What the board says that it is."""
        return self._identity

    @property
    def faults(self) -> dict[str, int]:
        """Faults on this side of the link since it was opened, all of them mended, by their kinds."""
        return self._session.faults.as_dict()

    def counters(self) -> dict[str, int]:
        """Read the counters of faults on the board's side, which docs/protocol.md explains, by their names.

        They count since the first call of this session, modulo 256 between two calls.
        """
        counts = list(self._session.request(Type.COUNTERS))
        if len(counts) != len(Counter):
            raise LinkError(f"the board must have {len(Counter)} counters, not {len(counts)}")
        if self._counted is not None:
            for n, (before, now) in enumerate(zip(self._counted, counts, strict=True)):
                self._totals[n] += (now - before) % 256
        self._counted = counts
        return {counter.name.lower(): total for counter, total in zip(Counter, self._totals, strict=True)}

    def run(self, **inputs: npt.ArrayLike) -> Results:
        """Filter physical values, from reset or from where the board stands, as `Design.run` does.

        Parameters
        ----------
        **inputs : array_like, shape (samples,) or (samples, channels)
            Physical values of each input, by its name; rounded to codes and limited to the range of the input. Shapes
            are broadcast.

        Returns
        -------
        Results
            One result for each sample; of a chain that interpolates, `Identity.results` for each.

        Raises
        ------
        SpecificationError
            If an input is missing, unknown or not finite, or the shapes do not fit.
        LinkError
            If the link fails.
        """
        names = [port.name for port in self._identity.input_ports]
        if sorted(inputs) != sorted(names):
            raise SpecificationError(f"the inputs must be {' and '.join(names)}, not {' and '.join(inputs) or 'none'}")
        try:
            values = np.broadcast_arrays(*(np.asarray(inputs[name], dtype=np.float64) for name in names))
            codes = np.stack(
                [port.encode(each) for port, each in zip(self._identity.input_ports, values, strict=True)], axis=-1
            )
        except (TypeError, ValueError) as error:
            raise SpecificationError(f"the inputs must be numbers whose shapes broadcast, not: {error}") from None
        if codes.ndim == 1 or codes.shape[1:-1] not in {(), (self._identity.channels,)}:
            shape = codes.shape[:-1]
            raise SpecificationError(
                f"the inputs must have the shape (samples,) or (samples, {self._identity.channels}), not {shape}"
            )
        if codes.ndim == 2:
            codes = np.broadcast_to(codes[:, np.newaxis], (len(codes), self._identity.channels, len(names)))
        return self.run_codes(codes)

    def run_codes(self, codes: Codes, progress: Callable[[int, int], None] = lambda done, total: None) -> Results:
        """Filter integer codes, shape (samples, inputs) or (samples, channels, inputs).

        Parameters
        ----------
        codes : ndarray of int
            Codes within the ranges of the inputs.
        progress : callable
            Called with the number of samples returned and their total.

        Raises
        ------
        SpecificationError
            If the shape is wrong, a code is out of range, or the board takes its samples from converters.
        LinkError
            If the link fails.
        """
        block = self._checked(codes)
        total = block.shape[0] * block.shape[1]
        received = bytearray()
        size, step = self._identity.results * self._identity.result_bytes, self._step
        for body in self._session.exchange(self._requests(block.reshape(total, -1)), self._sound):
            results = self._plain(body)
            asked = min(total - len(received) // size, step)
            if len(results) != asked * size:
                wanted, each = asked * self._identity.results, self._identity.result_bytes
                raise LinkError(f"the board must return {wanted} results, not {len(results) / each:g}")
            received += results
            progress(len(received) // size, total)
        return self._results(bytes(received))

    @property
    def _step(self) -> int:
        """Most samples of a request."""
        packing = self._identity.packing
        return self._identity.samples if packing is None else packing.per_message(self._identity.sample_bytes)

    def _plain(self, results: bytes) -> bytes:
        """Return results as they are without packing."""
        packing = self._identity.packing
        return results if packing is None else packing.plain(results)

    def _sound(self, results: bytes) -> bool:
        """Tell whether no bit of results lies outside its field: those of codes repeat the sign, those of flags are 0.

        Incomplete results are another matter. Behind packed results, all bits are 0.
        """
        packing = self._identity.packing
        if packing is not None:
            return packing.packed(packing.plain(results)) == results
        size = self._identity.result_bytes
        if len(results) % size:
            return True
        port, no_flag = self._identity.output_port, 0xFF - sum(1 << bit for bit in self._identity.flags.values())
        rows = np.frombuffer(results, np.uint8).reshape(-1, size)
        codes = rows[:, :-1].tobytes()
        return bytes_of(codes_of(codes, [port]), [port.bytes]) == codes and not np.any(rows[:, -1] & no_flag)

    def _requests(self, rows: Codes) -> Iterator[Request]:
        """Give requests with the samples of all channels in turn."""
        step = self._step
        kind = Type.SAMPLES if self._identity.packing is None else Type.SAMPLES_PACKED
        sizes = [port.bytes for port in self._identity.input_ports]
        for start in range(0, len(rows), step):
            yield kind, bytes([start % self._identity.channels]) + bytes_of(rows[start : start + step], sizes)

    def _results(self, data: bytes) -> Results:
        size = self._identity.result_bytes
        rows = np.frombuffer(data, np.uint8).reshape(-1, size)
        codes = codes_of(rows[:, :-1].tobytes(), [self._identity.output_port])[:, 0]
        codes, status = self._in_order(codes), self._in_order(rows[:, -1])
        return Results(
            values=self._identity.output_port.decode(codes),
            codes=codes,
            status=status.copy(),
            flags=dict(self._identity.flags),
        )

    def _in_order(self, column: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """Return a column of results, of which each sample of a channel has brought some, in the order of time."""
        channels, each = self._identity.channels, self._identity.results
        in_time = column.reshape(-1, channels, each).swapaxes(1, 2)
        return in_time.reshape((-1,) if channels == 1 else (-1, channels))

    def _checked(self, codes: Codes) -> Codes:
        if self._identity.source != "link":
            raise SpecificationError("the samples must come from the board's converters, not over the link")
        array = np.asarray(codes)
        block = array[:, np.newaxis] if array.ndim == 2 and self._identity.channels == 1 else array
        if block.ndim != 3 or block.shape[1:] != (self._identity.channels, len(self._identity.input_ports)):
            wanted = f"(samples, {self._identity.channels}, {len(self._identity.input_ports)})"
            raise SpecificationError(f"codes must have the shape {wanted}, not {array.shape}")
        if not np.issubdtype(block.dtype, np.integer):
            raise SpecificationError(f"codes must be integers, not {block.dtype}")
        for k, port in enumerate(self._identity.input_ports):
            column = block[..., k]
            if column.size and (column.min() < port.lowest or column.max() > port.highest):
                extremes = f"{column.min()}..{column.max()}"
                raise SpecificationError(
                    f"codes of {port.name} must be in {port.lowest}..{port.highest}, not {extremes}"
                )
        return block.astype(np.int64, copy=False)

    def poll(self) -> tuple[int, Results] | None:
        """Fetch results of a board with converters: the channel of the first one, and results of the channels in turn.

        None if there are none yet. The arrays have the shape (results,), whatever the number of channels.
        """
        return self._polled(self._session.request(self._poll_kind, check=self._polled_sound))

    def poll_all(self, most: int) -> Iterator[tuple[int, Results]]:
        """Fetch what `poll` fetches, until there are no more results or `most` have come, without a pause in between.

        Whoever stops earlier loses what was asked for meanwhile.
        """
        missing, empty = most, False

        def requests() -> Iterator[Request]:
            while missing > 0 and not empty:
                yield self._poll_kind, b""

        for body in self._session.exchange(requests(), self._polled_sound):
            fetched = self._polled(body)
            if fetched is None:
                empty = True
            else:
                missing -= len(fetched[1].codes)
                yield fetched

    @property
    def _poll_kind(self) -> Type:
        return Type.POLL if self._identity.packing is None else Type.POLL_PACKED

    def _polled_sound(self, body: bytes) -> bool:
        return self._sound(body[1:])

    def _polled(self, body: bytes) -> tuple[int, Results] | None:
        """Return the results of a response, None if it has none."""
        results = self._plain(body[1:])
        if not body or len(results) % self._identity.result_bytes:
            raise LinkError(f"the board must answer with whole results, not with {len(body)} bytes")
        if len(body) == 1:
            return None
        if body[0] >= self._identity.channels:
            raise LinkError(f"the board must name a channel below {self._identity.channels}, not {body[0]}")
        rows = np.frombuffer(results, np.uint8).reshape(-1, self._identity.result_bytes)
        codes = codes_of(rows[:, :-1].tobytes(), [self._identity.output_port])[:, 0]
        flags = dict(self._identity.flags)
        return body[0], Results(
            values=self._identity.output_port.decode(codes), codes=codes, status=rows[:, -1].copy(), flags=flags
        )

    def readings(self) -> dict[tuple[int, str], tuple[str, ...]]:
        """Read what was wrong with the last reading of each converter: by channel and name of the input.

        Names of faults are those of `sosmith.model.converters.spi_converter.ReadingFault` in small letters; none for a
        good reading.
        """
        body = self._session.request(Type.CONVERTERS)
        names = [port.name for port in self._identity.input_ports]
        if len(body) != self._identity.channels * len(names):
            raise LinkError(f"the board must tell of {self._identity.channels * len(names)} readings, not {len(body)}")
        return {
            (n // len(names), names[n % len(names)]): tuple(
                fault.name.lower() for fault in ReadingFault if byte >> fault & 1
            )
            for n, byte in enumerate(body)
        }

    def read_register(self, address: int) -> int:
        """Read the register at a byte address of the core; docs/registers.md lists them.

        Raises
        ------
        RefusedError
            If there is no such register.
        """
        word = self._session.request(Type.READ, bytes([address]))
        if len(word) != WORD_BYTES:
            raise LinkError(f"a register must have {WORD_BYTES} bytes, not {len(word)}")
        return int.from_bytes(word, "little")

    def write_register(self, address: int, *words: int) -> None:
        """Write words to the register at a byte address, one after another.

        Raises
        ------
        RefusedError
            If the core refuses one; those behind it may not have been written then.
        """
        parts = [words[start : start + MAX_WORDS] for start in range(0, len(words), MAX_WORDS)]
        bodies = (bytes([address]) + b"".join(word.to_bytes(WORD_BYTES, "little") for word in part) for part in parts)
        for _ in self._session.exchange((Type.WRITE, body) for body in bodies):
            pass

    def load(self, proven: str | PathLike[str] | Mapping[str, Any]) -> Loaded:
        """Load a set of coefficients, and read back that it is active.

        Parameters
        ----------
        proven : path or dict
            The file that `sosmith reload` has written, or its content.

        Returns
        -------
        Loaded
            What the registers read afterwards.

        Raises
        ------
        SpecificationError
            If it is no such file.
        ShortfallError
            If the set was made for another core, or something else is active afterwards.
        RefusedError
            If the core refuses the set, or has no registers; the former set stays active.
        """
        from sosmith.host.loading import load, read_set

        return load(self, read_set(proven))

    def lock(self) -> None:
        """Refuse all further loads until the board is reset.

        Raises
        ------
        ShortfallError
            If the board is not locked afterwards.
        RefusedError
            If the core has no lock, or a load is going on or still pending.
        """
        from sosmith.host.loading import lock

        lock(self)

    def _memory(self) -> bytes:
        """Read the text of the identity."""
        memory = b""
        while b"\0" not in memory:
            if len(memory) >= MAX_IDENTITY:
                raise LinkError(f"the board's identity must end within {MAX_IDENTITY} bytes")
            block = self._session.request(Type.IDENTITY, bytes([len(memory) // BLOCK_BYTES]))
            if len(block) != BLOCK_BYTES:
                raise LinkError(f"the board's identity must come in blocks of {BLOCK_BYTES} bytes, not {len(block)}")
            memory += block
        return memory
