"""Draws specifications of small cores for all architectures, from a seed: what the estimate of cost is fitted to.

Filters of all families and kinds, some behind a calibration, with the options that an architecture takes: channels,
reload, protect, start, decimate, samples_per_clock, look-ahead and a limit of multipliers.
"""

from __future__ import annotations

import random
from typing import NamedTuple

from sosmith.gen.fpga.boards import find_board
from sosmith.gen.realizations.registry import SECTIONS
from sosmith.gen.specification.choices import FAMILIES, LOSSES

BOARDS = ("icebreaker", "ice40_hx8k_b_evn", "ulx3s_25f", "ulx3s_25f", "tang_nano_9k", "tang_nano_9k")
"""Boards to draw from: iCE40, with and without multiplier blocks, ECP5 and Gowin in equal parts."""

_ARCHITECTURES = {"parallel": 38, "folded": 30, "serial": 24, "online": 8}
_CHANNELS = {1: 64, 2: 8, 3: 6, 4: 8, 8: 7, 16: 5, 32: 2}
_KINDS = {"lowpass": 60, "highpass": 15, "bandpass": 15, "bandstop": 10}
_LOSS_VALUES = {"passband_loss": 0.5, "stopband_loss": 50.0}

_FILTER = """\
name = "drawn"
sample_rate = 1.0
channels = {channels}
{inputs}
[filter]
family = "{family}"
kind = "{kind}"
order = {order}
cutoff = {cutoff}
{losses}
[output]
bits = {bits_out}
signed = {signed}
range = [{low}, {high}]
unit = ""
max_error = {error}
[hardware]
clock = 4.0e6
architecture = "{architecture}"
realization = "{realization}"
{options}
"""

_SIGNAL = """\
[input.x]
bits = {bits}
signed = true
range = [-1.0, 1.0]
"""

_SENSORS = """\
[input.voltage]
bits = {bits}
range = [0.0, 10.0]
[input.temperature]
bits = {bits_t}
range = [0.0, 128.0]
[calibration]
coefficients = [[{c[0]}, {c[1]}], [{c[2]}, {c[3]}], [{c[4]}]]
"""


class Draw(NamedTuple):
    """What was drawn.

    Attributes
    ----------
    toml : str
        The specification.
    board : str
        Board to design and to synthesize for.
    """

    toml: str
    board: str


def draw(seed: int) -> Draw:
    """Return what `seed` draws; not every such specification can be met."""
    rng = random.Random(seed)
    board = rng.choice(BOARDS)
    architecture = _weighted(rng, _ARCHITECTURES)
    if architecture == "folded" and not find_board(board).device.multipliers and rng.random() < 0.8:
        architecture = "serial"  # which the automatic choice takes there, too
    family, kind = rng.choice(FAMILIES), _weighted(rng, _KINDS)
    hardware, table, channels = _options(rng, architecture, kind, blocks=find_board(board).device.multipliers)
    calibrated = kind == "lowpass" and rng.random() < 0.3
    bits_out = rng.randint(8, 15)
    low, high = (0.0, 16.0) if calibrated else (-1.0, 1.0)
    losses = [f"{name} = {_LOSS_VALUES[name]}" for name in LOSSES.get(family, ())] + table
    toml = _FILTER.format(
        channels=channels,
        inputs=_inputs(rng, calibrated=calibrated),
        family=family,
        kind=kind,
        order=rng.randint(1, 2 if kind.startswith("band") else 4),
        cutoff=_cutoff(rng, kind, decimated=bool(table)),
        losses="\n".join(losses),
        bits_out=bits_out,
        signed="false" if calibrated else "true",
        low=low,
        high=high,
        error=rng.choice((0.75, 1, 2, 4)) * (high - low) / 2**bits_out,
        architecture=architecture,
        realization=_realization(rng, architecture, hardware, decimated=bool(table)),
        options="\n".join(hardware),
    )
    return Draw(toml, board)


def _weighted(rng: random.Random, weights: dict[str, int]) -> str:
    return rng.choices(list(weights), list(weights.values()))[0]


def _inputs(rng: random.Random, *, calibrated: bool) -> str:
    if not calibrated:
        return _SIGNAL.format(bits=rng.randint(8, 15))
    near = [value * rng.uniform(0.7, 1.3) for value in (1.16, -0.0036, 0.3672, 0.0006618, 0.05812)]
    return _SENSORS.format(bits=rng.randint(10, 14), bits_t=rng.randint(8, 12), c=[f"{value:.6f}" for value in near])


def _cutoff(rng: random.Random, kind: str, *, decimated: bool) -> str:
    low = 10 ** rng.uniform(-2.3, -0.4)
    if decimated:
        low /= 20
    if not kind.startswith("band"):
        return f"{low:.6f}"
    low = min(low, 0.2)
    return f"[{low:.6f}, {low * rng.uniform(1.4, 2.4):.6f}]"


def _options(rng: random.Random, architecture: str, kind: str, *, blocks: int) -> tuple[list[str], list[str], int]:
    """Return lines of the tables [hardware] and [filter], and the number of channels."""
    hardware, table = [], []
    channels = int(_weighted(rng, {str(key): weight for key, weight in _CHANNELS.items()}))
    what = rng.random()
    starts_from_zero = rng.random() < 0.15
    if architecture == "online":
        channels = 1
    elif what < 0.12 and kind != "bandstop":
        table.append(f"decimate = {rng.choice((2, 4, 8, 16))}")
        return hardware, table, channels
    elif architecture == "parallel" and what < 0.27:
        hardware.append(rng.choice(('pipeline = "look-ahead"', "samples_per_clock = 2", "samples_per_clock = 4")))
        channels = 1
    elif what < 0.4:
        hardware.append(f'protect = "{rng.choice(("detect", "correct"))}"')
    loads = architecture in {"folded", "serial"} or (architecture == "parallel" and blocks > 0)
    if loads and rng.random() < 0.12 and not (hardware and "protect" not in hardware[0]):
        hardware.append("reload = true")
    elif architecture == "parallel" and rng.random() < 0.3 and "look-ahead" not in "".join(hardware):
        hardware.append(f"multipliers = {rng.choice((0, 0, 2, 4))}")
    if starts_from_zero:
        hardware.append('start = "zero"')
    return hardware, table, channels


def _realization(rng: random.Random, architecture: str, hardware: list[str], *, decimated: bool) -> str:
    named = rng.choice([*SECTIONS])
    free = architecture != "online" and not decimated and "look-ahead" not in "".join(hardware)
    return named if free and rng.random() < 0.5 else "auto"
