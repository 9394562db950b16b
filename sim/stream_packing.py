"""Packs codes of a core's ports into beats of its streams, unpacks them, and draws a random order of channels."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from sosmith.gen.output.core_facts import StreamFacts
from sosmith.gen.output.vectors import words
from sosmith.hdl.plan.streams import Field
from sosmith.model.arrays import Codes
from sosmith.model.dataflow.status import STATUS_BITS
from sosmith.model.errors import ShortfallError
from sosmith.sim.beats import Beats

Order = npt.NDArray[np.int64]
"""Channel of each sample on a stream, shape (samples * channels,)."""

_BLOCK = 8  # samples per channel in each block; blocks in turn alternate with shuffled ones


_TAKEN = 1 << 18  # samples that are unpacked at a time


def random_order(samples: int, channels: int, seed: int) -> Order:
    """Draw an order in which blocks with the channels in turn alternate with shuffled blocks."""
    if channels == 1:
        return np.zeros(samples, dtype=np.int64)
    rng = np.random.default_rng(seed)
    blocks = []
    for start in range(0, samples, _BLOCK):
        block = np.tile(np.arange(channels), min(_BLOCK, samples - start))
        blocks.append(rng.permutation(block) if start // _BLOCK % 2 else block)
    return np.concatenate(blocks)


def completing(order: Order, samples: int) -> Order:
    """Return the channels of the results, of which a channel's first sample brings one, and each further group."""
    completed: Order = order[_turns(order) % samples == 0]
    return completed


def following(order: Order, rates: Sequence[tuple[int, int]]) -> Order:
    """Return the channels of the results of a chain, whose stages interpolate and decimate by `rates`, in order."""
    turns = _turns(order)
    through, before = turns + 1, turns
    for rise, factor in rates:
        through, before = (-(-each * rise // factor) for each in (through, before))
    followed: Order = np.repeat(order, through - before)
    return followed


def pack(codes: Codes, order: Order, stream: StreamFacts) -> Beats:
    """Pack codes into beats: each field is sign-extended to whole bytes.

    Parameters
    ----------
    codes : int64 array, shape (samples, channels, fields)
        Codes within the ranges of the ports.
    order : int64 array, shape (samples * channels,)
        Channel of each sample; the samples of a channel keep their order.
    stream : StreamFacts
        The stream, each of whose samples has at most 64 bits. If the last beat is not full, the last sample fills it.
    """
    taken = codes[:, 0] if codes.shape[1] == 1 else codes[_turns(order), order]
    packed = _joined(words(taken, stream), stream.sample_width, stream.lanes)
    count = len(packed)
    return Beats(order[:count], packed, np.zeros(count, dtype=np.uint64))


def unpack(beats: Beats, order: Order, stream: StreamFacts) -> tuple[Codes, npt.NDArray[np.uint8]]:
    """Return the codes of the beats, shape (samples, channels, fields), and their status, shape (samples, channels).

    Raises
    ------
    ShortfallError
        If the number of beats or a beat's channel differs from that of `order`, or a field is not sign-extended to
        whole bytes.
    """
    _check_channels(beats, order[: -(-len(order) // stream.lanes)])
    tdata = _apart(beats.tdata, stream.sample_width, stream.lanes)[: len(order)]
    tuser = _apart(beats.tuser, STATUS_BITS, stream.lanes)[: len(order)]
    channels = int(order.max()) + 1
    shape = (len(order) // channels, channels)
    codes = np.empty((*shape, len(stream.fields)), dtype=np.int64)
    status = np.empty(shape, dtype=np.uint8)
    turns = None if channels == 1 else _turns(order)
    for start in range(0, len(order), _TAKEN):
        part = slice(start, start + _TAKEN)
        place = (part, 0) if turns is None else (turns[part], order[part])
        for number, field in enumerate(stream.fields):
            codes[(*place, number)] = _field(tdata[part], field, start)
        status[place] = tuser[part]
    return codes, status


def _field(tdata: npt.NDArray[np.uint64], field: Field, start: int) -> Codes:
    """Return the codes of a field from bus words, the first of which is that of sample `start`."""
    column = (tdata >> np.uint64(field.offset) & np.uint64((1 << field.padded) - 1)).astype(np.int64)
    if field.port.signed:
        column = np.where(column >> (field.padded - 1), column - (1 << field.padded), column)
    wrong = np.flatnonzero((column < field.port.lowest) | (column > field.port.highest))
    if len(wrong):
        word = int(tdata[wrong[0]])
        raise ShortfallError(
            f"{field.port.name} must be extended to whole bytes, not {word:#x} at sample {start + wrong[0]}"
        )
    return column


def each_once(beats: Beats, copies: int) -> Beats:
    """Return each of the beats once that come `copies` times, one after the other.

    Raises
    ------
    ShortfallError
        If the number of beats is no multiple of that, or a copy differs.
    """
    if copies == 1:
        return beats
    if len(beats) % copies:
        raise ShortfallError(f"each result must come out {copies} times, not {len(beats)} beats in all")
    first = Beats(beats.tdest[::copies].copy(), beats.tdata[::copies].copy(), beats.tuser[::copies].copy())
    wanted = [number for number in first.numbers() for _ in range(copies)]
    wrong = [k for k, (number, want) in enumerate(zip(beats.numbers(), wanted, strict=True)) if number != want]
    if wrong:
        raise ShortfallError(f"result {wrong[0] // copies} must come out {copies} times, and changes meanwhile")
    return first


def _joined(samples: npt.NDArray[np.uint64], width: int, lanes: int) -> npt.NDArray[np.uint64]:
    """Join the words of `lanes` samples after the other into beats, the first one lowest."""
    if lanes == 1:
        return samples
    padded = np.append(samples, np.repeat(samples[-1:], -len(samples) % lanes)).astype("<u8")
    taken = padded.view(np.uint8).reshape(-1, 8)[:, : width // 8].reshape(len(padded) // lanes, -1)
    whole = np.pad(taken, ((0, 0), (0, -taken.shape[1] % 8)))
    beats: npt.NDArray[np.uint64] = np.ascontiguousarray(whole).view("<u8").astype(np.uint64)
    return beats[:, 0] if beats.shape[1] == 1 else beats


def _apart(beats: npt.NDArray[np.uint64], width: int, lanes: int) -> npt.NDArray[np.uint64]:
    """Take beats apart into the words of their samples."""
    if lanes == 1:
        return beats
    taken = np.ascontiguousarray(beats.astype("<u8")).view(np.uint8).reshape(len(beats), -1)
    each = taken[:, : lanes * width // 8].reshape(len(beats) * lanes, -1)
    whole = np.pad(each, ((0, 0), (0, 8 - each.shape[1])))
    split_up: npt.NDArray[np.uint64] = np.ascontiguousarray(whole).view("<u8").astype(np.uint64)[:, 0]
    return split_up


def _check_channels(beats: Beats, order: Order) -> None:
    if len(beats) != len(order):
        raise ShortfallError(f"{len(order)} samples must come out, not {len(beats)}")
    wrong = np.flatnonzero(beats.tdest != order)
    if len(wrong):
        index = wrong[0]
        raise ShortfallError(f"m_axis_tdest must be {order[index]}, not {beats.tdest[index]}, at output {index}")


def _turns(order: Order) -> npt.NDArray[np.int64]:
    """Index of each sample within its channel, shape as `order`."""
    turns = np.empty_like(order)
    for channel in range(int(order.max()) + 1):
        own = np.flatnonzero(order == channel)
        turns[own] = np.arange(len(own))
    return turns
