"""What combines in a specification: architectures and options of the hardware, and why the rest is refused.

The one table of it: the rules of a specification walk it, the automatic choice of an architecture asks it, and
`sosmith combinations` prints it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import Enum
from itertools import combinations as pairs
from typing import Any, NamedTuple, Protocol

from sosmith.gen.specification.values import UnfitError, literal


class Specified(Protocol):
    """What options are read from: a document, or the specification made of it."""

    @property
    def channels(self) -> int:
        """Number of channels."""

    @property
    def filter(self) -> Any:
        """The table [filter]."""

    @property
    def hardware(self) -> Any:
        """The table [hardware]."""


class Verdict(Enum):
    """Whether two things that a specification can ask for go together."""

    OK = "ok"
    NO_USE = "no use"
    """Refused: the one takes away what the other is for."""
    REFUSED = "refused"
    """For a reason of principle."""
    LATER = "not yet"
    """Nothing stands against it, but this version lacks it."""


class Refusal(NamedTuple):
    """Why two things do not go together.

    Attributes
    ----------
    verdict : Verdict
        Any but OK.
    reason : str
        Why; follows "as" in messages. Empty for what is not there yet.
    only : str
        What the key at fault must be instead; empty for what it is if nothing is asked for.
    """

    verdict: Verdict
    reason: str = ""
    only: str = ""


LATER = Refusal(Verdict.LATER)


@dataclass(frozen=True, eq=False, kw_only=True)
class Option:
    """What a specification can ask of the hardware beside a filter for one channel.

    Attributes
    ----------
    name : str
        Heading of its column.
    key : str
        Path of its key.
    of : callable
        Returns the value of the key in a specification.
    without : str
        What the key must be for the option not to be asked for.
    asks : callable
        Says whether a value asks for it.
    shows_value : bool
        Whether messages about other keys tell its value.
    first : bool
        Whether a message about an architecture that lacks it names the architecture as the key at fault.
    words : str
        How messages about other keys name it, if not by its key.
    """

    name: str
    key: str
    of: Callable[[Specified], object]
    without: str
    asks: Callable[[object], bool]
    shows_value: bool = True
    first: bool = False
    words: str = ""

    def asked(self, spec: Specified) -> bool:
        """Say whether a specification asks for it."""
        return self.asks(self.of(spec))

    def phrase(self, spec: Specified) -> str:
        """Return how messages about other keys name it, such as ``hardware.reload = true``."""
        if self.words:
            return self.words
        value = self.of(spec)
        shown = f'"{value}"' if isinstance(value, str) else literal(value)
        return f"{self.key} = {shown}" if self.shows_value else self.key


FIR = Option(
    name="FIR",
    key="filter",
    of=lambda d: d.filter.is_fir,
    without="of second-order sections",
    asks=bool,
    first=True,
    words="an FIR filter",
)
CHANNELS = Option(
    name="channels", key="channels", of=lambda d: d.channels, without="1", asks=lambda value: value != 1
)  # fmt: skip
RELOAD = Option(name="reload", key="hardware.reload", of=lambda d: d.hardware.reload, without="false", asks=bool)
PROTECT = Option(
    name="protect",
    key="hardware.protect",
    of=lambda d: d.hardware.protect,
    without="'none'",
    asks=lambda value: value != "none",
)
DECIMATE = Option(
    name="decimate",
    key="filter.decimate",
    of=lambda d: None if d.filter.is_fir else d.filter.decimate,
    without="left out",
    asks=lambda value: value is not None,
    shows_value=False,
    first=True,
)
FIR_DECIMATE = Option(
    name="decimate by FIR",
    key="filter.decimate",
    of=lambda d: d.filter.decimate if d.filter.is_fir and not d.filter.is_cic else None,
    without="left out",
    asks=lambda value: value is not None,
    first=True,
    words="an FIR filter that decimates",
)
CIC_DECIMATE = Option(
    name="decimate by CIC",
    key="filter.decimate",
    of=lambda d: d.filter.decimate if d.filter.is_cic else None,
    without="left out",
    asks=lambda value: value is not None,
    first=True,
    words="a CIC filter that decimates",
)
SEVERAL = Option(
    name="samples_per_clock",
    key="hardware.samples_per_clock",
    of=lambda d: d.hardware.samples_per_clock,
    without="1",
    asks=lambda value: value != 1,
    first=True,
)
LOOK_AHEAD = Option(
    name="look-ahead",
    key="hardware.pipeline",
    of=lambda d: d.hardware.pipeline,
    without="'auto' or 'plain'",
    asks=lambda value: value == "look-ahead",
    first=True,
)
ZERO = Option(
    name="start zero",
    key="hardware.start",
    of=lambda d: d.hardware.start,
    without="'steady'",
    asks=lambda value: value == "zero",
)
NO_MULTIPLIERS = Option(
    name="multipliers 0",
    key="hardware.multipliers",
    of=lambda d: d.hardware.multipliers,
    without="'auto'",
    asks=lambda value: value == 0,
)
FEW_MULTIPLIERS = Option(
    name="multipliers 1 or more",
    key="hardware.multipliers",
    of=lambda d: d.hardware.multipliers,
    without="'auto'",
    asks=lambda value: value not in {None, 0},
)

OPTIONS = (
    FIR,
    CHANNELS,
    RELOAD,
    PROTECT,
    DECIMATE,
    FIR_DECIMATE,
    CIC_DECIMATE,
    SEVERAL,
    LOOK_AHEAD,
    ZERO,
    NO_MULTIPLIERS,
    FEW_MULTIPLIERS,
)
"""All options, in the order in which tables show them."""


@dataclass(frozen=True, eq=False)
class Terms:
    """What an architecture takes.

    Attributes
    ----------
    name : str
        As in the specification.
    lacks : Mapping of Option to Refusal
        The options that it does not take, and why.
    apart : Mapping of (Option, Option) to Refusal
        Those that it takes, but not together.
    """

    name: str
    lacks: Mapping[Option, Refusal] = field(default_factory=dict)
    apart: Mapping[tuple[Option, Option], Refusal] = field(default_factory=dict)

    def takes(self, options: tuple[Option, ...]) -> bool:
        """Say whether it takes all of the options."""
        return not any(option in self.lacks for option in options) and not any(
            one in options and other in options for one, other in self.apart
        )


_SLOW = Refusal(Verdict.NO_USE, "{name} takes several clocks for each sample")
_ONE_BLOCK = Refusal(Verdict.REFUSED, "its program needs one", only="'auto' or at least 1")

_FIXED = Refusal(Verdict.REFUSED, "adders multiply by constants that are fixed")

_NO_TAPS = Refusal(Verdict.REFUSED, "its adders have no coefficients")

PARALLEL = Terms(
    "parallel",
    apart={
        (RELOAD, NO_MULTIPLIERS): _FIXED,
        (RELOAD, CIC_DECIMATE): _NO_TAPS,
        (RELOAD, FIR_DECIMATE): LATER,
        **dict.fromkeys(((PROTECT, other) for other in (FIR_DECIMATE, CIC_DECIMATE)), LATER),
    },
)
FOLDED = Terms("folded", {SEVERAL: _SLOW, LOOK_AHEAD: _SLOW, NO_MULTIPLIERS: _ONE_BLOCK})
SERIAL = Terms("serial", {SEVERAL: _SLOW, LOOK_AHEAD: _SLOW, FIR_DECIMATE: LATER, CIC_DECIMATE: LATER})
ONLINE = Terms(
    "online",
    {SEVERAL: _SLOW, LOOK_AHEAD: _SLOW}
    | dict.fromkeys(
        (FIR, CHANNELS, RELOAD, PROTECT, DECIMATE, FIR_DECIMATE, CIC_DECIMATE, NO_MULTIPLIERS, FEW_MULTIPLIERS), LATER
    ),
)

MULTIPLEXED = Terms(
    "multiplexed",
    {
        FIR: Refusal(Verdict.NO_USE, "it has no sections that could share hardware"),
        SEVERAL: _SLOW,
        LOOK_AHEAD: _SLOW,
        NO_MULTIPLIERS: Refusal(
            Verdict.REFUSED, "its constants change from section to section", only="'auto' or at least 1"
        ),
    }
    | dict.fromkeys((CHANNELS, RELOAD, PROTECT, DECIMATE, FIR_DECIMATE, CIC_DECIMATE), LATER),
)

TERMS = {terms.name: terms for terms in (PARALLEL, FOLDED, SERIAL, MULTIPLEXED, ONLINE)}
"""All architectures by name; `sosmith.gen.architectures.registry` has a class for each."""

CHAIN = Terms(
    "chain",
    {
        SEVERAL: Refusal(Verdict.LATER, "a stage after one that decimates gets single samples, not beats of several"),
        LOOK_AHEAD: Refusal(Verdict.LATER, "there is no rule yet for which stages of a chain need it"),
    },
)
"""What a chain of stages takes: what its stages take by themselves, but for these options."""

_APART: dict[tuple[Option, Option], Refusal] = {
    (FIR, LOOK_AHEAD): Refusal(Verdict.NO_USE, "it has no recursion, and registers between its sums without that"),
    **dict.fromkeys(
        ((SEVERAL, each) for each in (CHANNELS, RELOAD, PROTECT, DECIMATE, FIR_DECIMATE, CIC_DECIMATE)), LATER
    ),
    **dict.fromkeys(((LOOK_AHEAD, each) for each in (CHANNELS, PROTECT, DECIMATE)), LATER),
    **dict.fromkeys(
        ((each, LOOK_AHEAD) for each in (FIR_DECIMATE, CIC_DECIMATE)), Refusal(Verdict.NO_USE, "it has no recursion")
    ),
    (FIR_DECIMATE, NO_MULTIPLIERS): LATER,
    (LOOK_AHEAD, RELOAD): _FIXED,
    (RELOAD, FEW_MULTIPLIERS): Refusal(
        Verdict.REFUSED, "which products take blocks follows from coefficients, and these change"
    ),
}
"""Options that do not go together, in the order in which messages tell them: of the second one's key."""


def asked_by(spec: Specified) -> tuple[Option, ...]:
    """Return the options that a specification asks for."""
    return tuple(option for option in OPTIONS if option.asked(spec))


def excluded(option: Option, spec: Specified) -> bool:
    """Say whether a specification asks for options that do not go together with this one."""
    asked = asked_by(spec)
    return any((option, other) in _APART or (other, option) in _APART for other in asked)


def check_combinations(spec: Specified) -> None:
    """Check that what a specification asks for goes together.

    Raises
    ------
    UnfitError
        For the first finding.
    """
    asked = asked_by(spec)
    terms = TERMS.get(spec.hardware.architecture)
    for option in asked if terms is not None else ():
        assert terms is not None
        if (lacking := terms.lacks.get(option)) is not None:
            raise _without_option(spec, terms, option, lacking)
    for (kept, other), refusal in (_APART | ({} if terms is None else dict(terms.apart))).items():
        if kept in asked and other in asked:
            in_it = f'hardware.architecture = "{terms.name}" and ' if terms and (kept, other) in terms.apart else ""
            raise _unfit(refusal, other.without, in_it + kept.phrase(spec), other.key, literal(other.of(spec)))
    if terms is None:
        _check_that_any_takes(spec, asked)


def _check_that_any_takes(spec: Specified, asked: tuple[Option, ...]) -> None:
    """Check that an architecture takes all options together, where none is asked for.

    Raises
    ------
    UnfitError
        Of the last one of those that none takes together.
    """

    def is_taken(options: tuple[Option, ...]) -> bool:
        return any(terms.takes(options) for terms in TERMS.values())

    apart = asked
    for option in asked:
        others = tuple(each for each in apart if each is not option)
        apart = apart if is_taken(others) else others
    if apart and not is_taken(apart):
        *others_, last = apart
        beside = " and ".join(each.phrase(spec) for each in others_)
        raise _unfit(LATER, last.without, beside, last.key, literal(last.of(spec)))


def check_chain(spec: Specified) -> None:
    """Check that a chain takes what its specification asks for.

    Raises
    ------
    UnfitError
        For the first option that it does not take.
    """
    for option in asked_by(spec):
        if (refusal := CHAIN.lacks.get(option)) is not None:
            raise _unfit(refusal, option.without, "[[stage]]", option.key, literal(option.of(spec)))


def _without_option(spec: Specified, terms: Terms, option: Option, refusal: Refusal) -> UnfitError:
    """Return the error about an architecture that lacks an option: of the key that is easier to do without."""
    named = refusal._replace(reason=refusal.reason.format(name=terms.name))
    if not option.first:
        beside = f'hardware.architecture = "{terms.name}"'
        return _unfit(named, option.without, beside, option.key, literal(option.of(spec)))
    others = ["auto", *(name for name, each in TERMS.items() if each.takes((option,)))]
    expected = " or ".join(map(literal, others)) if len(others) < 3 else f"one of {', '.join(map(literal, others))}"
    return _unfit(named, expected, option.phrase(spec), "hardware.architecture", literal(terms.name))


def _unfit(refusal: Refusal, expected: str, beside: str, where: str, value: str) -> UnfitError:
    why = f", as {refusal.reason}" if refusal.reason else ""
    sentence = f"{refusal.only or expected} with {beside}{why}"
    return UnfitError(sentence, value, where=where, later=refusal.verdict is Verdict.LATER)


class Combination(NamedTuple):
    """Whether an architecture, or an option, goes together with an option.

    Attributes
    ----------
    row : str
        Name of the architecture or the option.
    option : str
        Name of the option beside it.
    verdict : str
        "ok", "no use", "refused" for a reason of principle, or "not yet".
    reason : str
        Why it is of no use, or refused; otherwise empty.
    beside : str
        Name of another option that the architecture takes, but not together with this one; otherwise empty.
    """

    row: str
    option: str
    verdict: str
    reason: str
    beside: str = ""


def combinations() -> tuple[Combination, ...]:
    """Return all pairs: of an architecture and an option, and of two options of different keys.

    After them, what a single architecture does not take together.
    """
    with_architecture = [
        _combination(terms.name, option, terms.lacks.get(option))
        for terms in (*TERMS.values(), CHAIN)
        for option in OPTIONS
    ]
    of_options = [
        _combination(one.name, other, _APART.get((one, other)) or _APART.get((other, one)))
        for one, other in pairs(OPTIONS, 2)
        if one.key != other.key
    ]
    apart = [
        _combination(terms.name, other, refusal)._replace(beside=one.name)
        for terms in TERMS.values()
        for (one, other), refusal in terms.apart.items()
    ]
    return (*with_architecture, *of_options, *apart)


def _combination(row: str, option: Option, refusal: Refusal | None) -> Combination:
    if refusal is None:
        return Combination(row, option.name, Verdict.OK.value, "")
    return Combination(row, option.name, refusal.verdict.value, refusal.reason.format(name=row))
