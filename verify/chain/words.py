"""Holds a chain's certificate, and the specifications of its stages, against the words of its specification.

What a table ``[[stage]]`` asks for is written here as the ``[filter]`` or ``[calibration]`` of a specification of its
own. The certificate of the stage is held against that specification by the verifier of cores.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any

from sosmith.verify.certificate_file import Certificate
from sosmith.verify.chain.chain_file import ChainCertificate
from sosmith.verify.chain.limits import check_chosen, check_limits, is_automatic, limits_of, span_of
from sosmith.verify.chain.responses import taps_in_turn
from sosmith.verify.graph import RejectedError, require
from sosmith.verify.specified.filter_table import read_filter_table
from sosmith.verify.specified.fir_mask import keeps_to_losses
from sosmith.verify.specified.sections_file import taps_in
from sosmith.verify.specified.stated_specification import CALIBRATED, stated_number, stated_port
from sosmith.verify.specified.words import with_fractions, words_of
from sosmith.verify.verdict.generated_files import about_of

_TABLES = ("name", "sample_rate", "channels", "input", "output", "calibration", "filter", "hardware")
_OF_ALL = ("architecture", "multipliers", "protect", "reload", "reload_lock", "start", "keep")
_OF_ONE = ("architecture", "realization", "multipliers", "protect", "reload", "reload_lock")
_CLOCK = 12_000_000
"""Clock of hardware whose specification has none, in Hz."""

_BY_ITSELF = ("taps", "taps_file", "sos", "sos_file")
_WITH_EDGES = ("iir", "fir", "halfband")
_OF_STAGES = ("name", "kind", *_OF_ONE, "band", "order", "decimate", "interpolate", "factor")


Groups = Sequence[tuple[Certificate, ...]]
"""The certificates of each stage's cores."""


def check_words(chain: ChainCertificate, text: str, groups: Groups, folder: Path) -> None:
    """Check that a chain and its stages are those that a specification in a folder describes.

    Raises
    ------
    RejectedError
        If one is not.
    """
    try:
        asked, own = words_of(text), words_of(chain.specification)
        if is_automatic(asked):
            check_chosen(asked, own)
        else:
            require(text == chain.specification, "the specification must have the text in the certificate of the chain")
        _check(chain, own, groups, folder)
    except (KeyError, TypeError, ValueError, IndexError, AttributeError) as error:
        raise RejectedError(f"the specification must be valid and complete, not: {error!r}") from None


def _check(chain: ChainCertificate, tree: Mapping[str, Any], groups: Groups, folder: Path) -> None:
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
    _same("the output", chain.output, output)
    allowed = tree["output"].get("max_error", "faithful")
    _same("max_error", chain.max_error, output.lsb if allowed == "faithful" else stated_number(allowed))
    rate = first = stated_number(tree["sample_rate"])
    for stage, cores in zip(stages, groups, strict=True):
        rise = stage.get("interpolate", 1)
        _same(f"the number of cores of stage {stage['name']}", len(cores), rise)
        for core in cores:
            _check_core(chain, tree, stage, core, rate)
        table = "calibration" if stage["kind"] == "polynomial" else "filter"
        if rise > 1:
            _check_taps(stage, cores, rate * rise, folder)
        else:
            own = words_of(about_of(cores[0]).specification)
            wanted = with_fractions(_table(stage, rate))
            _same(f"the {table} of stage {stage['name']}", with_fractions(own[table]), wanted)
        rate = rate * rise / stage.get("decimate", 1)
    limits, span = limits_of(tree), span_of(tree)
    if limits is None or span is not None:
        require(all(entry.kept is None for entry in chain.folding), "a chain without limits must claim none")
    _same("the stages with limits of their own", _span_in(chain), span)
    if limits is not None and span is not None:
        rates = _rates(stages, first)
        assert chain.limited is not None  # as it has the span
        check_limits([chain.limited], limits, rates[span[0]])
        edge = limits.passband_edge / rates[span[0]]
        _same("the edge of the pass band that has limits", chain.limited.edge, edge)
    elif limits is not None:
        check_limits(chain.folding, limits, first)
    of_whole = None if limits is None or span is not None else limits.passband_edge
    _check_edges(chain, stages, first, of_whole)


def _span_in(chain: ChainCertificate) -> tuple[int, int] | None:
    return None if chain.limited is None else (chain.limited.first, chain.limited.last)


def _rates(stages: Sequence[Mapping[str, Any]], rate: Fraction) -> list[Fraction]:
    """Return the rate of the samples of each stage, in Hz."""
    rates = []
    for stage in stages:
        rates.append(rate)
        rate = rate * stage.get("interpolate", 1) / stage.get("decimate", 1)
    return rates


def _check_core(
    chain: ChainCertificate, tree: Mapping[str, Any], stage: Mapping[str, Any], core: Certificate, rate: Fraction
) -> None:
    """Check all but the filter or calibration of a core's specification."""
    own = words_of(about_of(core).specification)
    what = f"stage {stage['name']}"
    _same(f"the sample_rate of {what}", stated_number(own["sample_rate"]), rate)
    _same(f"the channels of {what}", own.get("channels", 1), chain.channels)
    require(stage["kind"] == "polynomial" or "calibration" not in own, f"{what} must have no calibration")
    hardware = tree.get("hardware", {})
    wanted = {"clock": hardware.get("clock", _CLOCK)}
    for keys, words in ((_OF_ALL, hardware), (_OF_ONE, stage)):
        wanted |= {key: words[key] for key in keys if key in words}
    if stage.get("interpolate", 1) > 1 and wanted.get("reload"):  # the registers are those of all cores of the stage
        wanted.pop("reload_lock", None)
        wanted |= {"reload_registers": False, "realization": wanted.get("realization", "fir_direct")}
    _same(f"the hardware of {what}", with_fractions(own.get("hardware", {})), with_fractions(wanted))
    others = [key for key in own if key not in _TABLES]
    require(not others, f"the specification of {what} must be without {', '.join(others)}")


def _check_taps(stage: Mapping[str, Any], cores: Sequence[Certificate], rate: Fraction, folder: Path) -> None:
    """Check the taps of a stage that interpolates, of which core k has every L-th, from tap k on.

    Those that are given are as they are, and others times L, so that the gain in the pass band is about 1.
    """
    what, rise = f"stage {stage['name']}", len(cores)
    tables = [words_of(about_of(core).specification)["filter"] for core in cores]
    require(all(list(table) == ["taps"] for table in tables), f"the filters of {what} must have their taps alone")
    if stage["kind"] == "cic" or "taps" in stage or "taps_file" in stage:
        if stage["kind"] == "cic":
            wanted = [tap * rise for tap in _moving_sums(rise, stage["order"])]
        elif "taps" in stage:
            wanted = [stated_number(tap) for tap in stage["taps"]]
        else:
            wanted = list(taps_in(folder / stage["taps_file"]))
        for k, table in enumerate(tables):
            own = [stated_number(tap) for tap in table["taps"]]
            _same(f"the taps of {what}, phase {k},", own, wanted[k::rise])
        return
    read = read_filter_table(_table(stage, rate), rate)
    require(
        read.is_fir and keeps_to_losses([tap / rise for tap in taps_in_turn(cores)], read),
        f"the filter of {what} must keep to its edges and losses, with symmetric taps",
    )


def _check_edges(
    chain: ChainCertificate, stages: Sequence[Mapping[str, Any]], rate: Fraction, edge_of_limits: Fraction | None
) -> None:
    """Check that the pass band ends at that of the limits, or the lowest edge of the low-pass filters.

    That counts where it comes out as itself.
    """
    ends = [edge_of_limits] if edge_of_limits is not None else _ends(stages)
    for entry in chain.folding:
        highest = rate * entry.rise
        lowest = min(rate, highest / entry.factor)
        edge = min(ends) / highest if ends and 2 * min(ends) <= lowest else None
        _same("the edge of the pass band, in units of the highest rate,", entry.edge, edge)
        rate = highest / entry.factor


def _ends(stages: Sequence[Mapping[str, Any]]) -> list[Fraction]:
    """Return the edges of the low-pass filters."""
    return [
        stated_number(stage.get("passband_edge", stage.get("cutoff")))
        for stage in stages
        if stage["kind"] in _WITH_EDGES
        and stage.get("band", "lowpass") == "lowpass"
        and ("passband_edge" in stage or "cutoff" in stage)
    ]


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


def _same(what: str, proven: object, stated: object) -> None:
    require(proven == stated, f"{what} must be as the specification of the chain says, {stated}, not {proven}")
