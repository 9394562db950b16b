"""Reads the specification of a chain: a table ``[[stage]]`` for each stage, in order, and what is common to all.

Rules about a filter are those of a filter alone; what is here is about the tables of stages, and stages beside each
other.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from decimal import Decimal
from fractions import Fraction
from math import prod
from pathlib import Path
from typing import Any

from sosmith.gen.chain.automatic.asked import Place, check_factor, check_kinds, limits_in
from sosmith.gen.chain.automatic.limits import KEYS, LIMITS
from sosmith.gen.chain.automatic.structures import MAX_STAGES
from sosmith.gen.chain.specification import ANY_INPUT, ANY_OUTPUT, ChainSpec, StageSpec, decimal, is_decimal
from sosmith.gen.specification.choices import AUTO, FIR_FAMILIES, MAX_DECIMATION, MAX_DOWNSAMPLING, MAX_GIVEN_TAPS
from sosmith.gen.specification.combinations import check_chain
from sosmith.gen.specification.specification import STAGE, Specification, from_tree, parsed, text_of, to_json
from sosmith.gen.specification.toml_text import toml_text
from sosmith.gen.specification.values import (
    IDENTIFIER,
    UnfitError,
    choice,
    identifier,
    literal,
    number,
    one_of,
    together,
    whole,
)
from sosmith.model.dataflow.cic import impulse_response
from sosmith.model.errors import SpecificationError
from sosmith.model.port import Port
from sosmith.model.suggestion import did_you_mean

MAX_FACTOR = 1 << 12
"""Most samples for each result, and results for each sample: the response is computed at the highest rate."""

_EDGES = ("passband_edge", "stopband_edge", "passband_loss", "stopband_loss")
_OF_ONE = ("architecture", "realization", "multipliers", "protect", "reload", "reload_lock")
"""Keys of ``[hardware]`` that a stage can have of its own."""

_COMMON = ("name", "kind", *_OF_ONE)
_KEYS: dict[str, tuple[str, ...]] = {
    "polynomial": ("coefficients", "data"),
    "gain": ("factor",),
    "iir": ("family", "band", "method", "order", "cutoff", *_EDGES, "freedom", "sos", "sos_file", "decimate"),
    "fir": ("family", "band", *_EDGES, "freedom", "taps", "taps_file", "decimate", "interpolate"),
    "halfband": ("passband_edge", "passband_loss", "stopband_loss", "freedom", "decimate", "interpolate"),
    "cic": ("order", "decimate", "interpolate"),
    AUTO: ("decimate", *KEYS),
}
"""Keys of a stage by its kind, beside those of all."""

KINDS = tuple(_KEYS)
_RISING = tuple(kind for kind, keys in _KEYS.items() if "interpolate" in keys)

_TAKEN = "flags"
"""What a module of the chain itself is called behind its name."""

_TOP = ("name", "sample_rate", "channels", "input", STAGE, LIMITS, "output", "hardware")
_WIRE = {"sos": [[1, 0, 0, 1, 0, 0]]}
_ANY_DECIMATOR = {"filter": {"taps": [Decimal(1)], "decimate": 2}}
"""Stands for the stages that will be chosen where rules about the hardware are checked."""


def keys_of(kind: str) -> tuple[str, ...]:
    """Return the keys that a stage of this kind can have."""
    return (*(_COMMON if kind != AUTO else _COMMON[:2]), *_KEYS[kind])


def is_chain(tree: Mapping[str, Any]) -> bool:
    """Say whether a specification is that of a chain."""
    return STAGE in tree


def load_chain(path: Path) -> ChainSpec:
    """Read and check the specification of a chain in a file.

    Raises
    ------
    SpecificationError
        If it is none, or breaks a rule.
    """
    text = text_of(path)
    return chain_from_tree(parsed(text, path), path, text)


def chain_from_tree(tree: Mapping[str, Any], path: Path, text: str | None = None) -> ChainSpec:
    """Check a specification that has been read, with every float as `decimal.Decimal`.

    Raises
    ------
    SpecificationError
        If it breaks a rule.
    """
    try:
        return _checked(dict(tree), path, text)
    except UnfitError as unfit:
        raise SpecificationError(f"{path}: {unfit}") from None


def _checked(tree: dict[str, Any], path: Path, text: str | None) -> ChainSpec:
    for key, value in tree.items():
        if key not in _TOP:
            raise UnfitError(f"left out with [[stage]], which takes {', '.join(_TOP)}", literal(value), where=str(key))
    stages = tree.get(STAGE)
    if not isinstance(stages, list) or not all(isinstance(stage, dict) for stage in stages):
        raise UnfitError("a list of tables [[stage]]", literal(stages), where=STAGE)
    if not 1 <= len(stages) <= MAX_STAGES:
        raise UnfitError(f"a list of 1 to {MAX_STAGES} tables [[stage]]", f"{len(stages)} of them", where=STAGE)
    kinds = [_kind(stage, k) for k, stage in enumerate(stages)]
    common = {key: value for key, value in tree.items() if key not in {STAGE, LIMITS}}
    if kinds[0] == "polynomial":
        common["calibration"] = {key: stages[0][key] for key in _KEYS["polynomial"] if key in stages[0]}
    base = from_tree(common | {"filter": _WIRE}, path)
    check_chain(base)
    _check_common(base)
    read, rate, findings = [], base.sample_rate, []
    for k, stage in enumerate(stages):
        try:
            _check_rate(rate, f"stage[{k}]")
            read.append(_stage(stage, kinds[k], k, rate))
            rate *= Fraction(read[-1].rise, read[-1].factor)
        except UnfitError as unfit:
            findings.append(unfit)
            if not is_decimal(rate):
                break
    if findings:
        raise together(findings)
    _check_names([stage.name for stage in read])
    _check_factors(read)
    check_kinds(kinds)
    limits, span = limits_in(
        tree, [Place(each.name, each.kind, each.rate, each.factor, rises=each.rise > 1) for each in read]
    )
    chain = ChainSpec(
        base=base,
        source={key: to_json(value) for key, value in tree.items()},
        text=text if text is not None else toml_text(tree),
        stages=tuple(read),
        limits=limits,
        span=span,
        tree=tree,
    )
    _check_steps(chain)
    for one in chain.stages:
        if one.kind != "polynomial":
            one.ordinary(chain, (ANY_INPUT,), ANY_OUTPUT)
    return chain


def _check_common(base: Specification) -> None:
    """Check that what is common to all stages is nothing that each of them has of its own."""
    hardware = base.hardware
    for key, value, default in (
        ("realization", hardware.realization, AUTO),
        ("reload_registers", hardware.reload_registers, True),
    ):
        if value != default:
            raise UnfitError(
                "left out with [[stage]], as every stage has its own", literal(value), where=f"hardware.{key}"
            )


def _kind(stage: Mapping[str, Any], k: int) -> str:
    if "kind" not in stage:
        raise UnfitError(one_of(KINDS), "missing", where=f"stage[{k}].kind")
    try:
        return choice(KINDS)(stage["kind"])
    except UnfitError as unfit:
        raise unfit.inside(f"stage[{k}].kind") from None


def _stage(table: Mapping[str, Any], kind: str, k: int, rate: Fraction) -> StageSpec:
    where = f"stage[{k}]"
    known = keys_of(kind)
    for key, value in table.items():
        if key == "interpolate" and kind not in _RISING:
            raise UnfitError(
                f"left out in a stage of the kind {kind}: between samples, {', '.join(_RISING)} fill in",
                literal(value),
                where=f"{where}.{key}",
            )
        if key not in known:
            raise UnfitError(
                f"one of the keys {', '.join(known)} in a stage of the kind {kind}",
                f"an unknown one{did_you_mean(key, known)}",
                where=f"{where}.{key}",
            )
    if "name" not in table:
        raise UnfitError(IDENTIFIER, "missing", where=f"{where}.name")
    try:
        name = identifier(table["name"])
    except UnfitError as unfit:
        raise unfit.inside(f"{where}.name") from None
    if kind == "polynomial" and k > 0:
        raise UnfitError(
            "another kind after the first stage, as the gain of a polynomial differs from value to value",
            literal(kind),
            where=f"{where}.kind",
        )
    factor, rise = _factor(table, kind, where), _rise(table, where)
    return StageSpec(
        name=name,
        kind=kind,
        tables=_tables(table, kind, where, rate * rise, factor, rise),
        hardware={key: table[key] for key in _OF_ONE if key in table},
        factor=factor,
        rise=rise,
        rate=rate,
        edge=_edge(table, kind),
    )


def _factor(table: Mapping[str, Any], kind: str, where: str) -> int:
    if kind == "cic" and "decimate" not in table and "interpolate" not in table:
        raise UnfitError("given for a CIC filter, or interpolate", "missing", where=f"{where}.decimate")
    if table.get("decimate") == AUTO:
        raise UnfitError(
            "a whole number in a stage, as the rates of the stages after it follow from it",
            literal(AUTO),
            where=f"{where}.decimate",
        )
    if "decimate" not in table:
        if kind == AUTO:
            raise UnfitError(f"a whole number from 2 to {MAX_FACTOR}", "missing", where=f"{where}.decimate")
        return 1
    most = {"iir": MAX_DECIMATION, AUTO: MAX_FACTOR}.get(kind, MAX_DOWNSAMPLING)
    try:
        factor = whole(2, most)(table["decimate"])
    except UnfitError as unfit:
        raise unfit.inside(f"{where}.decimate") from None
    if kind == "iir" and factor & (factor - 1):
        raise UnfitError(
            f"a power of two from 2 to {most} for a filter with poles", literal(factor), where=f"{where}.decimate"
        )
    if kind == AUTO:
        check_factor(factor, f"{where}.decimate")
    return factor


def _rise(table: Mapping[str, Any], where: str) -> int:
    if "interpolate" not in table:
        return 1
    if "decimate" in table:
        raise UnfitError(
            "left out beside decimate: a stage that interpolates and one that decimates in series do both",
            literal(table["interpolate"]),
            where=f"{where}.interpolate",
        )
    try:
        return whole(2, MAX_DOWNSAMPLING)(table["interpolate"])
    except UnfitError as unfit:
        raise unfit.inside(f"{where}.interpolate") from None


def _check_rate(rate: Fraction, where: str) -> None:
    if not is_decimal(rate):
        raise UnfitError(
            "at a rate that is a finite decimal in Hz, so that its edges compare exactly",
            f"at {literal(rate)} Hz",
            where=where,
        )


def _tables(table: Mapping[str, Any], kind: str, where: str, rate: Fraction, factor: int, rise: int) -> dict[str, Any]:
    """Return the tables of the ordinary specification, of a filter at this rate."""
    decimate = {"decimate": factor} if factor > 1 else {}
    if kind == "polynomial":
        return {"calibration": {key: table[key] for key in _KEYS[kind] if key in table}, "filter": _WIRE}
    if kind == AUTO:
        return _ANY_DECIMATOR
    if kind == "gain":
        return {"filter": {"taps": [_gain(table, where)]}}
    if kind == "cic":
        return {"filter": {"taps": _cic(table, where, factor if rise == 1 else rise)} | decimate}
    given = {key: table[key] for key in _KEYS[kind] if key in table and key not in {"band", "decimate", "interpolate"}}
    if kind == "halfband":
        given |= _halfband(given, where, rate)
    if kind == "fir" and not {*_EDGES, "taps", "taps_file"} & given.keys():
        raise UnfitError(
            f"given by {', '.join(_EDGES[:-1])} and {_EDGES[-1]}, or by one of taps and taps_file",
            "by none of them",
            where=where,
        )
    if "band" in table or kind == "halfband" or _by_bands(given):
        given["kind"] = table.get("band", "lowpass")
    if kind == "fir" and _by_bands(given) and "family" not in given:
        given["family"] = "equiripple"
    is_fir = kind != "iir"
    if "family" in given and (given["family"] in FIR_FAMILIES) != is_fir:
        families = "an FIR family" if is_fir else "a family with poles"
        raise UnfitError(f"{families} in a stage of the kind {kind}", literal(given["family"]), where=f"{where}.family")
    return {"filter": given | decimate}


def _gain(table: Mapping[str, Any], where: str) -> Any:
    """Return a factor, which is a number other than 0, as it was read."""
    expected = "a number other than 0"
    try:
        if not number(table.get("factor", 0), expected):
            raise UnfitError(expected, literal(table["factor"]) if "factor" in table else "missing")
    except UnfitError as unfit:
        raise unfit.inside(f"{where}.factor") from None
    return table["factor"]


def _halfband(given: Mapping[str, Any], where: str, rate: Fraction) -> dict[str, Any]:
    """Return what a half-band filter has beside what is given: its stop band follows from its pass band."""
    for key in ("passband_edge", "passband_loss", "stopband_loss"):
        if key not in given:
            raise UnfitError("given for a half-band filter", "missing", where=f"{where}.{key}")
    try:
        edge = number(given["passband_edge"])
    except UnfitError as unfit:
        raise unfit.inside(f"{where}.passband_edge") from None
    return {"family": "halfband", "stopband_edge": decimal(rate / 2 - edge)}


def _by_bands(given: Mapping[str, Any]) -> bool:
    return not any(key in given for key in ("taps", "taps_file", "sos", "sos_file"))


def _cic(table: Mapping[str, Any], where: str, factor: int) -> list[Decimal]:
    """Taps of moving sums of `factor` samples in series, whose gain at zero frequency is 1."""
    if "order" not in table:
        raise UnfitError("given for a CIC filter", "missing", where=f"{where}.order")
    try:
        order = whole(1, 12)(table["order"])
    except UnfitError as unfit:
        raise unfit.inside(f"{where}.order") from None
    key = "interpolate" if "interpolate" in table else "decimate"
    if factor & (factor - 1):
        raise UnfitError(
            "a power of two for a CIC filter, whose weights are then exact", literal(factor), where=f"{where}.{key}"
        )
    if order * (factor - 1) + 1 > MAX_GIVEN_TAPS:
        raise UnfitError(
            f"such that order * ({key} - 1) is below {MAX_GIVEN_TAPS}, as it has so many taps; two stages in series "
            f"{key} further",
            literal(factor),
            where=f"{where}.{key}",
        )
    return [decimal(Fraction(tap, factor**order)) for tap in impulse_response(factor, order)]


def _edge(table: Mapping[str, Any], kind: str) -> Fraction | None:
    """Upper edge of a low-pass filter's pass band, as far as it is a number."""
    if table.get("band", "lowpass") != "lowpass" or kind in {"polynomial", "gain", "cic"}:
        return None
    try:
        return number(table.get("passband_edge", table.get("cutoff")))
    except UnfitError:
        return None


def _check_names(names: list[str]) -> None:
    small = [name.lower() for name in names]
    for k, name in enumerate(names):
        if small[k] == _TAKEN:
            raise UnfitError(
                f"another name than {_TAKEN}, which a module of the chain has", literal(name), where=f"stage[{k}].name"
            )
        if small[k] in small[:k]:
            raise UnfitError(
                "different from the names of the stages before, in small letters too, as files are named after it",
                literal(name),
                where=f"stage[{k}].name",
            )
        for other in names:
            if small[k].startswith(f"{other.lower()}_"):
                raise UnfitError(
                    f"a name that does not begin with {other}_, as parts of the stage {other} do",
                    literal(name),
                    where=f"stage[{k}].name",
                )


def _check_factors(stages: Sequence[StageSpec]) -> None:
    for key, factors in (("decimate", [s.factor for s in stages]), ("interpolate", [s.rise for s in stages])):
        for k in range(len(factors)):
            if prod(factors[: k + 1]) > MAX_FACTOR:
                rate = "first" if key == "decimate" else "last"
                raise UnfitError(
                    f"such that all stages together {key} by at most {MAX_FACTOR}, as their response is computed at "
                    f"the {rate} rate",
                    literal(factors[k]),
                    where=f"stage[{k}].{key}",
                )
    turns = [k for k, stage in enumerate(stages) if k > 0 and (stage.rise > 1 or stage.factor > 1)]
    ups = [stages[k].rise > 1 for k in turns]
    changes = [turns[n] for n in range(1, len(turns)) if ups[n] != ups[n - 1]]
    if len(changes) > 1:
        k = changes[1]
        key = "interpolate" if stages[k].rise > 1 else "decimate"
        raise UnfitError(
            "left out where the rate has turned behind the first stage once already, as flags follow one turn",
            literal(max(stages[k].rise, stages[k].factor)),
            where=f"stage[{k}].{key}",
            later=True,
        )


def _check_steps(chain: ChainSpec) -> None:
    """Check that steps can change where they must: not inside an FIR filter that decimates."""
    ratio = chain.base.inputs[0].lsb / chain.base.output.lsb
    fits = not ratio.numerator & (ratio.numerator - 1) and not ratio.denominator & (ratio.denominator - 1)
    if all(stage.needs_powers_of_two for stage in chain.stages) and not fits:
        raise UnfitError(
            "such that the ratio of the LSBs of input and output is a power of two, as all stages are FIR filters "
            "that decimate",
            literal([chain.base.output.lsb * code for code in _ends(chain.base.output)]),
            where="output.range",
        )


def _ends(port: Port) -> tuple[int, int]:
    return port.lowest, port.lowest + 2**port.bits
