"""The manifest, which programs read: every field of it is derived from the certificate, or named as not held.

A manifest decides nothing: which hardware is proven, and how, follows from the certificate. Numbers are doubles there:
each must be the exact figure but for what their arithmetic rounds. An error must be no less than the proven one.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

from sosmith.verify.certificate_file import Certificate, ItemEntry, PortEntry, StreamEntry
from sosmith.verify.graph import RejectedError, require
from sosmith.verify.parallel.check import HardwareVerdict
from sosmith.verify.program.text import ProgramText
from sosmith.verify.specified.words import table_of, words_of
from sosmith.verify.unit.check import UnitVerdict
from sosmith.verify.verdict.derived import (
    Figure,
    bound_of,
    decimation_of,
    formats_of,
    operators_of,
    parts_of,
    sections_of,
    settling_of,
)
from sosmith.verify.verdict.item import wear_limits

_NO_MANIFEST = (ValueError, KeyError, TypeError, AttributeError, OverflowError, RecursionError, IndexError)
"""What is raised where a manifest has anything else."""

_CLOCKS = ("reset_cycles", "latency_cycles", "cycles_per_sample")
_WORDS = ("realization", "reasons", "limit_cycles")
"""Names, sentences and bounds that nothing here derives."""

_OPTIONAL = ("pipeline",)


@dataclass
class Manifest:
    """A manifest that is being compared.

    Attributes
    ----------
    tree : mapping
        Its fields.
    open : list of str
        Fields that were not held against anything.
    """

    tree: Mapping[str, Any]
    open: list[str] = field(default_factory=list)

    def hold_clocks(self, found: HardwareVerdict | UnitVerdict | None) -> None:
        """Hold the clocks against those that are proven of a pipeline, which takes a sample at each, or of a unit."""
        if found is None:
            self.open += _CLOCKS
            return
        clocks: tuple[int, int, int]
        if isinstance(found, UnitVerdict):
            clocks = found.progress.cleared + found.pace.opening, found.pace.latency, found.pace.interval
        else:
            clocks = found.clearing, found.latency, 1
        for key, value in zip(_CLOCKS, clocks, strict=True):
            _compare(key, self.tree[key], value)

    def hold_program(self, found: ProgramText | None) -> None:
        """Hold the schedule against the program that was read from the hardware; None if none was."""
        schedule = self.tree["schedule"]
        if schedule is None:
            return
        if found is None:
            self.open.append("schedule")
            return
        wanted = {
            "digit_bits": found.digit_bits,
            "accumulator_bits": found.accumulator_bits,
            "words": found.words,
            "instructions": [[each.opcode, each.address, each.constant, each.target] for each in found.instructions],
        }
        for key, value in wanted.items():
            _compare(f"schedule.{key}", schedule[key], value)
        self.open += ["schedule.states", "schedule.places"]


def read_manifest(content: bytes, certificate: Certificate, item: ItemEntry) -> Manifest:
    """Read a manifest, and hold it against a certificate.

    Clocks and program are left to `Manifest.hold_clocks` and `Manifest.hold_program`.

    Raises
    ------
    RejectedError
        If it is no manifest, or the first field that differs.
    """
    try:
        tree = json.loads(content, object_pairs_hook=_once, parse_constant=_refused)
        manifest = Manifest(tree)
        _check(manifest, certificate, item)
    except _NO_MANIFEST:
        raise RejectedError("the manifest must be that of a core, not another file") from None
    return manifest


def _once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    tree = dict(pairs)
    require(len(tree) == len(pairs), "a key of the manifest must be there once")
    return tree


def _refused(word: str) -> float:
    raise ValueError(word)


def _check(manifest: Manifest, certificate: Certificate, item: ItemEntry) -> None:
    tree = manifest.tree
    wanted: dict[str, Any] = {
        "name": certificate.name,
        "core": item.core,
        "channels": item.channels,
        "architecture": item.architecture,
        "protect": item.protect,
        "start": None if item.core == "calibration" else item.start,
        "streams": {
            "s_axis": _stream_of(item.taken, certificate.inputs, item, flags=False),
            "m_axis": _stream_of(item.given, (certificate.output,), item, flags=True),
        },
        "error_bound": bound_of(certificate),
        "error_bound_proven": True,
        "error_parts": parts_of(certificate),
        "error_unit": certificate.output.unit,
        "formats": formats_of(certificate),
    }
    wanted |= _specified(certificate, item)
    sections, named = sections_of(certificate)
    keys = [*wanted, *_CLOCKS, *_WORDS, "reload", "schedule", "sections", "aliasing", "decimation", "cost"]
    for key in tree:
        require(key in keys or key in _OPTIONAL, f"the manifest must not have the field {_cut(key)}")
    for key, value in wanted.items():
        _compare(key, tree[key], value)
    manifest.open += [key for key in (*_WORDS, *_OPTIONAL) if tree.get(key)]
    _check_sections(manifest, tree["sections"], sections, named)
    _check_decimation(manifest, certificate, item)
    _check_reload(manifest, certificate, item)
    program = item.architecture in {"folded", "serial"}
    require((tree["schedule"] is not None) == program, f"the manifest must{'' if program else ' not'} have a schedule")
    if tree["aliasing"] is not None:
        manifest.open.append("aliasing")
    cost = operators_of(certificate, item)
    if cost is None or tree["cost"]["multipliers"] != cost["multipliers"]:
        manifest.open.append("cost")
    else:
        _compare("cost", tree["cost"], cost)


def _specified(certificate: Certificate, item: ItemEntry) -> dict[str, Any]:
    """Return what is in the words of the specification that the certificate holds."""
    about = certificate.about
    assert about is not None  # as an item is
    words = words_of(about.specification)
    limits = wear_limits(table_of(words, "wear"))[: len(item.wear)]
    rate = Fraction(words.get("sample_rate", 0))
    return {
        "sosmith_version": about.versions.get("sosmith"),
        "spec": _as_json(words),
        "wear": [
            {"warning": Figure(warning), "critical": Figure(critical), "codes": list(codes)}
            for (warning, critical), codes in zip(limits, item.wear, strict=True)
        ]
        or None,
        "settling": settling_of(certificate, rate),
    }


def _as_json(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _as_json(each) for key, each in value.items()}
    if isinstance(value, list):
        return [_as_json(each) for each in value]
    return value if isinstance(value, str | bool | int) else float(value)


def _check_sections(
    manifest: Manifest, found: list[dict[str, Any]], wanted: list[dict[str, Any]], named: list[str]
) -> None:
    """Compare the sections with one input and output; the parts of others are named."""
    rest = {entry["name"]: entry for entry in found}
    require(len(rest) == len(found), "each section of the manifest must have a name of its own")
    for entry in wanted:
        name = entry["name"]
        require(name in rest, f"sections in the manifest must have {name}")
        other = rest.pop(name)
        _compare(f"sections.{name}", {key: value for key, value in other.items() if key != "error_feedback"}, entry)
    if any("error_feedback" in entry for entry in found):
        manifest.open.append("sections.error_feedback")
    for name in rest:
        require(name.partition(" ")[0] in named, f"sections in the manifest must not have {_cut(name)}")
        manifest.open.append(f"sections.{name}")


def _check_decimation(manifest: Manifest, certificate: Certificate, item: ItemEntry) -> None:
    found, entry = manifest.tree["decimation"], certificate.decimation
    require(
        (found is not None) == (entry is not None),
        f"the manifest must{'' if entry else ' not'} have a decimation, as in the certificate",
    )
    if found is None or entry is None:
        return
    about = certificate.about
    assert about is not None
    wanted = decimation_of(certificate, item, entry, Fraction(words_of(about.specification).get("sample_rate", 0)))
    for key, value in wanted.items():
        if key == "calibration":
            _check_ahead(manifest, found.get("calibration"), value)
        else:
            _compare(f"decimation.{key}", found[key], value)
    manifest.open += [f"decimation.{key}" for key in found if key not in wanted]


def _check_ahead(manifest: Manifest, found: Mapping[str, Any] | None, wanted: Mapping[str, Any] | None) -> None:
    if found is None or wanted is None:
        _compare("decimation.calibration", found, wanted)
        return
    for key, value in wanted.items():
        _compare(f"decimation.calibration.{key}", found[key], value)
    manifest.open += [f"decimation.calibration.{key}" for key in found if key not in wanted]


def _check_reload(manifest: Manifest, certificate: Certificate, item: ItemEntry) -> None:
    found = manifest.tree["reload"]
    require(
        (found is not None) == item.reload,
        f"reload in the manifest must be {'there' if item.reload else 'None'}, as in the certificate, "
        f"not {_cut(found)}",
    )
    if found is not None:
        _compare("reload.registers", found["registers"], [f"{certificate.name}_registers.h", f"{certificate.name}.rdl"])
        manifest.open += [f"reload.{key}" for key in found if key != "registers"]


def _stream_of(stream: StreamEntry, ports: tuple[PortEntry, ...], item: ItemEntry, *, flags: bool) -> dict[str, Any]:
    made: dict[str, Any] = {} if not stream.dest_width else {"tdest": {"width": stream.dest_width}}
    made["width"] = stream.width
    if item.samples > 1:
        made |= {"samples": item.samples, "sample_width": stream.width // item.samples}
    made["fields"] = [
        {
            "name": each.name,
            "offset": each.offset,
            "width": each.width,
            "signed": each.signed,
            "lsb": Figure(each.lsb),
            "zero": Figure(each.zero),
            "unit": port.unit,
        }
        for each, port in zip(stream.fields, ports, strict=True)
    ]
    if flags:
        made["tuser"] = {"width": stream.user_width, "flags": dict(item.flags)}
    return made


def _compare(what: str, found: Any, wanted: Any) -> None:
    """Compare trees of JSON, whose numbers may be figures."""
    if isinstance(wanted, dict) and isinstance(found, dict):
        for key in (*wanted, *found):
            require(
                key in found and key in wanted,
                f"{what} in the manifest must {'have' if key in wanted else 'not have'} {_cut(key)}",
            )
            _compare(f"{what}.{key}", found[key], wanted[key])
    elif isinstance(wanted, list) and isinstance(found, list):
        require(len(found) == len(wanted), f"{what} in the manifest must have {len(wanted)} entries, not {len(found)}")
        for index, (one, other) in enumerate(zip(found, wanted, strict=True)):
            _compare(f"{what}[{index}]", one, other)
    else:
        right = wanted.holds if isinstance(wanted, Figure) else _same(wanted)
        require(
            right(found), f"{what} in the manifest must be {_cut(wanted)}, as in the certificate, not {_cut(found)}"
        )


def _same(wanted: Any) -> Callable[[Any], bool]:
    return lambda found: type(found) is type(wanted) and found == wanted


def _cut(value: object) -> str:
    text = str(value) if isinstance(value, Figure) else ascii(value)
    text = text.strip("'") if isinstance(value, str) else text
    return text if len(text) <= 200 else f"{text[:200]}.."
