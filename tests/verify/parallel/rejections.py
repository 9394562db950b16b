"""Texts of parallel cores, edited, and what is said of them."""

from collections import Counter

from tests.verify.parallel.cores import Made
from tests.verify.parallel.edits import random_edits, swept
from tests.verify.parallel.simulated import outputs

from sosmith.verify.graph import RejectedError


def rejection(core: Made, text: str) -> str:
    """Return the sentence of a rejection; nothing if a text is accepted."""
    try:
        core.check(text)
    except RejectedError as error:
        return str(error)
    return ""


NODE = r"node \d+ \(.+\) of "


def proven(seen: list[dict[str, int]], lanes: int) -> list[dict[str, int]]:
    """Return outputs without the flags that no certificate speaks of."""
    flags = int.from_bytes([5] * lanes)
    return [{name: value & flags if name == "m_axis_tuser" else value for name, value in row.items()} for row in seen]


def sweep(core: Made, count: int, seed: int, clocks: int) -> Counter[str]:
    """Edit at random; what is accepted must be the same in simulation, and what is rejected must have a sentence."""

    def seen(text: str) -> object:
        return proven(outputs(text, clocks, seed, core.channels), core.lanes)

    return swept(random_edits(core.text, count, seed), lambda text: rejection(core, text), seen, core.text, NODE)
