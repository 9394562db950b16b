"""Holds a chain's certificate, and the specifications of its stages, against the words of its specification.

What a table ``[[stage]]`` asks for is written here as the ``[filter]`` or ``[calibration]`` of a specification of its
own. The certificate of the stage is held against that specification by the verifier of cores.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from decimal import Decimal
from fractions import Fraction
from typing import Any

from sosmith.verify.certificate_file import Certificate
from sosmith.verify.chain.chain_file import ChainCertificate
from sosmith.verify.graph import RejectedError, require
from sosmith.verify.specified.stated_specification import CALIBRATED, stated_number, stated_port
from sosmith.verify.specified.words import words_of
from sosmith.verify.verdict.generated_files import about_of

_TABLES = ("name", "sample_rate", "channels", "input", "output", "calibration", "filter", "hardware")
_OF_ALL = ("architecture", "multipliers", "protect", "reload", "reload_lock", "start", "keep")
_OF_ONE = ("architecture", "realization", "multipliers", "protect", "reload", "reload_lock")
_CLOCK = 12_000_000
"""Clock of hardware whose specification has none, in Hz."""

_BY_ITSELF = ("taps", "taps_file", "sos", "sos_file")
_WITH_EDGES = ("iir", "fir", "halfband")
_OF_STAGES = ("name", "kind", *_OF_ONE, "band", "order", "decimate", "factor")


def check_words(chain: ChainCertificate, text: str, cores: Sequence[Certificate]) -> None:
    """Check that a chain and its stages are those that a specification describes.

    Raises
    ------
    RejectedError
        If one is not.
    """
    require(text == chain.specification, "the specification must have the text in the certificate of the chain")
    try:
        _check(chain, words_of(text), cores)
    except (KeyError, TypeError, ValueError, IndexError, AttributeError) as error:
        raise RejectedError(f"the specification must be valid and complete, not: {error!r}") from None


def _check(chain: ChainCertificate, tree: Mapping[str, Any], cores: Sequence[Certificate]) -> None:
    stages = tree["stage"]
    kinds = [stage["kind"] for stage in stages]
    _same("the name", chain.name, tree["name"])
    _same("the stages", [(entry.name, entry.kind) for entry in chain.stages], [(s["name"], s["kind"]) for s in stages])
    _same("the number of channels", chain.channels, tree.get("channels", 1))
    unit = tree["output"].get("unit", "")
    calibrated = kinds[0] == "polynomial"
    names = CALIBRATED if calibrated else dict.fromkeys(tree["input"], unit)
    inputs = tuple(stated_port(name, tree["input"][name], of) for name, of in names.items())
    _same("the inputs", chain.inputs, inputs)
    output = stated_port("clearance" if calibrated else "y", tree["output"], unit)
    _same("the output", chain.output.model_copy(update={"name": output.name}), output)
    allowed = tree["output"].get("max_error", "faithful")
    _same("max_error", chain.max_error, output.lsb if allowed == "faithful" else stated_number(allowed))
    rate = stated_number(tree["sample_rate"])
    for stage, core in zip(stages, cores, strict=True):
        own = words_of(about_of(core).specification)
        what = f"stage {stage['name']}"
        _same(f"the sample_rate of {what}", stated_number(own["sample_rate"]), rate)
        _same(f"the channels of {what}", own.get("channels", 1), chain.channels)
        table = "calibration" if stage["kind"] == "polynomial" else "filter"
        require(stage["kind"] == "polynomial" or "calibration" not in own, f"{what} must have no calibration")
        _same(f"the {table} of {what}", _plain(own[table]), _plain(_table(stage, rate)))
        hardware = tree.get("hardware", {})
        wanted = {"clock": hardware.get("clock", _CLOCK)}
        for keys, words in ((_OF_ALL, hardware), (_OF_ONE, stage)):
            wanted |= {key: words[key] for key in keys if key in words}
        _same(f"the hardware of {what}", _plain(own.get("hardware", {})), _plain(wanted))
        others = [key for key in own if key not in _TABLES]
        require(not others, f"the specification of {what} must be without {', '.join(others)}")
        rate /= stage.get("decimate", 1)
    _check_edge(chain, stages, stated_number(tree["sample_rate"]), rate)


def _check_edge(chain: ChainCertificate, stages: Sequence[Mapping[str, Any]], rate: Fraction, last: Fraction) -> None:
    """Check that the pass band ends at the lowest edge of the low-pass filters, if that comes out as itself."""
    if chain.folding is None:
        return
    ends = [
        stated_number(stage.get("passband_edge", stage.get("cutoff")))
        for stage in stages
        if stage["kind"] in _WITH_EDGES
        and stage.get("band", "lowpass") == "lowpass"
        and ("passband_edge" in stage or "cutoff" in stage)
    ]
    edge = min(ends) / rate if ends and 2 * min(ends) <= last else None
    _same("the edge of the pass band, in units of the sample rate,", chain.folding.edge, edge)


def _table(stage: Mapping[str, Any], rate: Fraction) -> dict[str, Any]:
    """Return what a stage asks for as a table of a specification of its own."""
    given = {key: value for key, value in stage.items() if key not in _OF_STAGES}
    decimate = {"decimate": stage["decimate"]} if "decimate" in stage else {}
    match stage["kind"]:
        case "polynomial":
            return given
        case "gain":
            return {"taps": [stage["factor"]]}
        case "cic":
            return {"taps": _moving_sums(stage["decimate"], stage["order"])} | decimate
        case "halfband":
            edge = {"stopband_edge": rate / 2 - stated_number(stage["passband_edge"])}
            return given | edge | decimate | {"family": "halfband", "kind": "lowpass"}
    order = {"order": stage["order"]} if "order" in stage else {}
    by_bands = not any(key in stage for key in _BY_ITSELF)
    kind = {"kind": stage.get("band", "lowpass")} if by_bands or "band" in stage else {}
    family = {"family": "equiripple"} if by_bands and stage["kind"] == "fir" else {}
    return family | given | kind | order | decimate


def _moving_sums(factor: int, order: int) -> list[Fraction]:
    """Coefficients of ``((1 + w + .. + w**(factor - 1)) / factor)**order``."""
    taps = [Fraction(1)]
    for _ in range(order):
        longer = [Fraction(0)] * (len(taps) + factor - 1)
        for k, tap in enumerate(taps):
            for shift in range(factor):
                longer[k + shift] += tap / factor
        taps = longer
    return taps


def _plain(value: Any) -> Any:
    """Return a tree with every number as a fraction."""
    if isinstance(value, Mapping):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_plain(item) for item in value]
    if isinstance(value, int | Decimal) and not isinstance(value, bool):
        return Fraction(value)
    return value


def _same(what: str, proven: object, stated: object) -> None:
    require(proven == stated, f"{what} must be as the specification of the chain says, {stated}, not {proven}")
