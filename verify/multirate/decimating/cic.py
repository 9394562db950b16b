"""Proves that integrators and combs give every R-th result of a certificate's FIR filter, which is a CIC filter.

::

    sample --> [sum1] --> .. N .. --> [sumN] --> every R-th --> [difference1] --> .. N .. --> [differenceN] --> result

Each register takes over what `sosmith.verify.multirate.decimating.ladder` says. N combs behind N integrators are N
moving sums, modulo ``2**width``, once each comb holds a result: what the sums held before does not count, as each comb
takes away a power of the polynomial that comes of it. So the last difference is the sum of the samples times the taps
of N moving sums, as that fits so many bits; after N R times the first sample, that is so whatever there was before.
Several channels have memories in place of sums and combs, of which each is shown the same by itself
(`sosmith.verify.multirate.decimating.channels`). Everything else is as for any core that decimates
(`sosmith.verify.multirate.decimating.results`).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence, Set
from dataclasses import dataclass, fields

from sosmith.verify.certificate_file import Certificate, ItemEntry
from sosmith.verify.graph import require
from sosmith.verify.multirate.decimating.channel_ladder import ChannelLadder
from sosmith.verify.multirate.decimating.channels import ChannelEntrance
from sosmith.verify.multirate.decimating.ladder import Ladder
from sosmith.verify.multirate.decimating.results import ResultCheck, decimating_netlist
from sosmith.verify.multirate.logic import Logic, MemoryPart, Part
from sosmith.verify.multirate.ring.verdict import RingVerdict
from sosmith.verify.parallel.netlist import Netlist
from sosmith.verify.program.normal_form import Form, constant, plus
from sosmith.verify.reader.recursion import deep_recursion


@dataclass(frozen=True)
class CicVerdict(RingVerdict):
    """The result of the check of a core with integrators and combs.

    Attributes
    ----------
    adder_bits, register_bits : int
        Bits of their sums, and of what they hold.
    """

    adder_bits: int
    register_bits: int


def is_cic(certificate: Certificate) -> bool:
    """Say whether the exact filter of a certificate with a downsampling is one of moving sums, times any number."""
    down = certificate.downsampling
    taps = [] if len(certificate.ideal.sections) != 1 else list(certificate.ideal.sections[0].numerator)
    if down is None or down.factor < 2 or not taps or taps[0] <= 0 or (len(taps) - 1) % (down.factor - 1):
        return False
    sums = moving_sums(down.factor, (len(taps) - 1) // (down.factor - 1))
    return len(taps) > 1 and all(tap == taps[0] * one for tap, one in zip(taps, sums, strict=True))


def moving_sums(factor: int, order: int) -> list[int]:
    """Return the taps of so many moving sums of `factor` samples in series."""
    taps, ends = [1], [0] * (factor - 1)
    for _ in range(order):
        padded = [*ends, *taps, *ends]
        taps = [sum(padded[k : k + factor]) for k in range(len(padded) - len(ends))]
    return taps


def check_cic(text: str, certificate: Certificate, item: ItemEntry) -> CicVerdict:
    """Prove that a core with integrators and combs computes every R-th result of the graphs of a certificate.

    Parameters
    ----------
    text : str
        SystemVerilog of the core.
    certificate : Certificate
        Its certificate, which `verify` has accepted, with a downsampling.
    item : ItemEntry
        What it is about.

    Raises
    ------
    RejectedError
        If it computes anything else, or has anything that is not known here.
    """
    netlist = decimating_netlist(text, certificate, item.channels)
    with deep_recursion():
        return _Check(netlist, certificate, item).checked()


class _Check(ResultCheck):
    """The check of a core."""

    def __init__(self, netlist: Netlist, certificate: Certificate, item: ItemEntry) -> None:
        super().__init__(netlist, certificate, item)
        factor, order = self.entrance.factor, self.fills_for(self.entrance.factor)
        width = self.netlist.widths.get("sum1", 0)
        most = factor**order
        low, high = (-(1 << width - 1), (1 << width - 1) - 1) if self.port.signed and width else (0, (1 << width) - 1)
        fits = low <= self.port.lowest * most and self.port.highest * most <= high
        require(fits, f"sum1 must have bits for {most} times the range of the input, not {width} bits")
        self._ladder: Ladder | ChannelLadder
        if isinstance(self.entrance, ChannelEntrance):
            self._ladder = ChannelLadder(self.entrance, order, width)
        else:
            self._ladder = Ladder(self.entrance, order, width)

    def fills_for(self, factor: int) -> int:
        """Return N, which follows from what the graph remembers."""
        order, rest = divmod(self.remembered, factor - 1)
        require(
            order > 0 and not rest,
            f"a CIC filter must remember a multiple of {factor - 1} samples, not {self.remembered}",
        )
        return order

    @property
    def parts(self) -> Sequence[Part]:
        """Integrators and combs."""
        return [self._ladder]

    @property
    def memories(self) -> MemoryPart | None:
        """Those of several channels."""
        return self._ladder if isinstance(self._ladder, ChannelLadder) else None

    @property
    def positions(self) -> int:
        """One for each of them."""
        return 2 * self._ladder.order

    @property
    def fresh(self) -> int:
        """Up to the last comb."""
        return self.positions - 1

    def comes(self, now: Logic) -> bool:
        """Whether the last difference is new."""
        return bool(now.bit(self._ladder.moved))

    def coming(self) -> Iterator[tuple[Mapping[str, Form], bool]]:
        """Yield whether it is."""
        for moved in (0, 1):
            yield {self._ladder.moved: constant(moved)}, bool(moved)

    def last_position(self, inside: Set[str]) -> Mapping[str, Form]:
        """Return the last difference: the samples times the taps of as many moving sums."""
        del inside
        total: Form = {}
        for ago, tap in enumerate(moving_sums(self.entrance.factor, self._ladder.order)):
            total = plus(total, self.sample(ago), tap)
        return {self._ladder.last: total, self._ladder.moved: constant(1)}

    def checked(self) -> CicVerdict:
        """Check everything; return what is proven."""
        ladder = self._ladder
        proven = self.verdict(2 * ladder.order)
        return CicVerdict(
            **{each.name: getattr(proven, each.name) for each in fields(proven)},
            adder_bits=2 * ladder.order * ladder.width,
            register_bits=3 * ladder.order * ladder.width,
        )
