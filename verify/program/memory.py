"""Which words of a program hold which values of the graph, and when: what a map of its memory must say.

A place is true if each of its words holds its digit of the value that it names at some moment of a sample: a low digit
may have been read, and its word be used again, for the next one too. A map is whole
if it has a place for all words of a state, of an input, and of each value that the program stores.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from sosmith.verify.graph import require
from sosmith.verify.program.normal_form import Form

Digits = Callable[[int, int, int], list[Form]]
"""Digits of a node with a number of fraction bits: the node, these, and how many digits."""


@dataclass(frozen=True)
class Kept:
    """A state in its words: the name and the fraction bits of its code."""

    addresses: tuple[int, ...]
    name: str
    frac: int


@dataclass(frozen=True)
class Memory:
    """What the words of a program hold in a sample.

    Attributes
    ----------
    states : tuple of Kept
        The states.
    stored : tuple of tuple of int
        Addresses of each value that is stored.
    taken : set of int
        Addresses of the digits of the inputs.
    written : tuple of (int, Form)
        Words in the order in which they get what they hold: the states at the start, then what is written.
    nodes : mapping of str to int
        Nodes of the graph by their names.
    digits : callable
        Digits of a node.
    """

    states: tuple[Kept, ...]
    stored: tuple[tuple[int, ...], ...]
    taken: frozenset[int]
    written: tuple[tuple[int, Form], ...]
    nodes: Mapping[str, int]
    digits: Digits

    @property
    def kept(self) -> int:
        """Number of words that are kept from one sample to the next."""
        return sum(len(state.addresses) for state in self.states)

    def check(self, places: Sequence[Mapping[str, Any]]) -> None:
        """Check a map of the memory: entries with `name`, `addresses`, `frac` and `state`.

        Raises
        ------
        RejectedError
            If an entry is not true, or one is missing.
        """
        names = [place["name"] for place in places]
        require(len(set(names)) == len(names), "each place in the manifest must have a name of its own")
        for place in places:
            name, addresses = place["name"], tuple(place["addresses"])
            where = f"schedule.places of the manifest must say where {ascii(name)[1:-1][:80]} is"
            plain = set(place) == {"name", "addresses", "frac", "state"} and type(place["state"]) is bool
            numbers = all(type(number) is int for number in (*addresses, place["frac"]))
            require(plain and numbers and name in self.nodes, where)
            state = Kept(addresses, name, place["frac"]) in self.states
            require(place["state"] == state and (state or self._holds(name, addresses, place["frac"])), where)
        listed = {tuple(place["addresses"]) for place in places}
        for wanted in (*self.stored, *(state.addresses for state in self.states)):
            require(
                wanted in listed,
                f"schedule.places of the manifest must have the words {', '.join(map(str, wanted))}",
            )
        for address in sorted(self.taken - {address for addresses in listed for address in addresses}):
            require(False, f"schedule.places of the manifest must have the words {address}")
        missing = [state.name for state in self.states if state.name not in names]
        require(not missing, f"schedule.places of the manifest must have {', '.join(missing)}")

    def _holds(self, name: str, addresses: tuple[int, ...], frac: int) -> bool:
        """Whether words hold the digits of a value, each at some moment."""
        if not addresses or len(addresses) > 64 or abs(frac) > 4096:
            return False
        wanted = zip(addresses, self.digits(self.nodes[name], frac, len(addresses)), strict=True)
        return all((address, form) in self.written for address, form in wanted)
