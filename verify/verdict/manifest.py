"""The manifest, which programs read: every field of it is derived from the certificate, or named as not held.

A manifest decides nothing: which hardware is proven, and how, follows from the certificate. Numbers are doubles there:
each must be the exact figure but for what their arithmetic rounds. An error must be no less than the proven one.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

from sosmith.verify.certificate_file import Certificate, DownsamplingEntry, ItemEntry, PortEntry, StreamEntry
from sosmith.verify.graph import RejectedError, require
from sosmith.verify.multirate.ring.verdict import RingVerdict
from sosmith.verify.parallel.check import HardwareVerdict
from sosmith.verify.program.check import ProgramVerdict
from sosmith.verify.specified.words import table_of, words_of
from sosmith.verify.unit.check import UnitVerdict
from sosmith.verify.verdict.cost import cost_of
from sosmith.verify.verdict.derived import (
    bound_of,
    decimation_of,
    downsampling_of,
    formats_of,
    parts_of,
    section_of,
    settling_of,
)
from sosmith.verify.verdict.figures import Figure
from sosmith.verify.verdict.item import wear_limits
from sosmith.verify.verdict.recursions import Recursion, is_realized_as, recursions_of
from sosmith.verify.verdict.resting import limit_cycles_of
from sosmith.verify.verdict.scope import Proofs

_NO_MANIFEST = (ValueError, KeyError, TypeError, AttributeError, OverflowError, RecursionError, IndexError)
"""What is raised where a manifest has anything else."""

_CLOCKS = ("reset_cycles", "latency_cycles", "cycles_per_sample")
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

    def hold_clocks(self, verdict: HardwareVerdict | UnitVerdict | None) -> None:
        """Hold the clocks against those that are proven of a pipeline, which takes a sample at each, or of a unit."""
        if verdict is None:
            self.open += _CLOCKS
            return
        clocks: tuple[int, int, int]
        if isinstance(verdict, UnitVerdict):
            clocks = verdict.progress.cleared + verdict.pace.opening, verdict.pace.latency, verdict.pace.interval
        else:
            clocks = verdict.clearing, verdict.latency, verdict.interval
        if isinstance(verdict, RingVerdict) and verdict.factor > 1:
            self._held_clocks(verdict)
        for key, value in zip(_CLOCKS, clocks, strict=True):
            _compare(key, self.tree[key], value)

    def _held_clocks(self, verdict: RingVerdict) -> None:
        key = "decimation.cycles_per_result"
        _compare(key, self.tree["decimation"]["cycles_per_result"], verdict.result_clocks)
        self.open.remove(key)

    def hold_cost(self, certificate: Certificate, item: ItemEntry, proofs: Proofs) -> None:
        """Hold the operators against those of the graphs, made as the hardware that was proven makes them."""
        try:
            cost = cost_of(certificate, item, proofs, self.tree["cost"])
        except _NO_MANIFEST:
            raise RejectedError("cost in the manifest must be that of a core, not anything else") from None
        if cost is None:
            self.open.append("cost")
        else:
            _compare("cost", self.tree["cost"], cost)

    def hold_program(self, verdict: ProgramVerdict | None) -> None:
        """Hold the schedule against the program of the hardware and what its words hold; None if it was not read."""
        schedule = self.tree["schedule"]
        if schedule is None:
            return
        if verdict is None:
            self.open.append("schedule")
            return
        program = verdict.program
        wanted = {
            "digit_bits": program.digit_bits,
            "accumulator_bits": program.accumulator_bits,
            "states": verdict.memory.kept,
            "words": program.words,
            "instructions": [[*each[: 2 + 2 * program.products]] for each in program.instructions],
        }
        places = schedule["places"]
        _compare("schedule", {**schedule, "places": []}, wanted | {"places": []})
        try:
            verdict.memory.check(places)
        except _NO_MANIFEST:
            raise RejectedError("schedule.places in the manifest must be places of words") from None


def read_manifest(content: bytes, certificate: Certificate, item: ItemEntry) -> Manifest:
    """Read a manifest, and hold it against a certificate.

    Clocks, cost and program are left to `Manifest.hold_clocks`, `Manifest.hold_cost` and `Manifest.hold_program`.

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
    sections = recursions_of(certificate)
    wanted |= _sections(certificate, sections)
    keys = [*wanted, *_CLOCKS, "realization", "reload", "schedule", "aliasing", "decimation", "cost"]
    for key in tree:
        require(key in keys or key in _OPTIONAL, f"the manifest must not have the field {_cut(key)}")
    for key, value in wanted.items():
        _compare(key, tree[key], value)
    _check_realization(tree, sections, _asked_for(certificate))
    _check_decimation(manifest, certificate, item)
    _check_reload(manifest, certificate, item)
    program = item.architecture in {"folded", "serial"} and certificate.downsampling is None
    require((tree["schedule"] is not None) == program, f"the manifest must{'' if program else ' not'} have a schedule")
    if tree["aliasing"] is not None:
        manifest.open.append("aliasing")


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


def _sections(certificate: Certificate, sections: Sequence[Sequence[Recursion]]) -> dict[str, Any]:
    parts = [part for section in sections for part in section]
    return {
        "sections": [section_of(part) for part in parts],
        "limit_cycles": [limit_cycles_of(part, certificate.output) for part in parts],
    }


def _asked_for(certificate: Certificate) -> object:
    """Return the realization that was asked for; None if the choice was left open."""
    about = certificate.about
    assert about is not None
    stated = table_of(words_of(about.specification), "hardware").get("realization", "auto")
    asked = about.options.get("realization", stated)
    return None if asked == "auto" else asked


def _check_realization(tree: Mapping[str, Any], sections: Sequence[Sequence[Recursion]], asked: object) -> None:
    """Check that the name of the realization is the one asked for, or true of the graphs, and what it says of them."""
    name = tree["realization"]
    if not sections:
        _compare("realization", name, None)
    else:
        require(
            is_realized_as(name, sections),
            f"realization in the manifest must be that of the sections in the certificate, not {_cut(name)}",
        )
    looks_ahead = isinstance(name, str) and name.startswith("look_ahead_")
    if sections and asked is not None and not looks_ahead:
        _compare("realization", name, asked)
    _compare("pipeline", tree.get("pipeline"), "look-ahead" if looks_ahead else None)


def _check_decimation(manifest: Manifest, certificate: Certificate, item: ItemEntry) -> None:
    facts, entry = manifest.tree["decimation"], certificate.decimation
    if certificate.downsampling is not None and certificate.downsampling.factor > 1:
        _check_downsampling(manifest, certificate, item, certificate.downsampling)
        return
    require(
        (facts is not None) == (entry is not None),
        f"the manifest must{'' if entry else ' not'} have a decimation, as in the certificate",
    )
    if facts is None or entry is None:
        return
    about = certificate.about
    assert about is not None
    wanted = decimation_of(certificate, item, entry, Fraction(words_of(about.specification).get("sample_rate", 0)))
    for key, value in wanted.items():
        if key == "calibration":
            _check_ahead(manifest, facts.get("calibration"), value)
        else:
            _compare(f"decimation.{key}", facts[key], value)
    manifest.open += [f"decimation.{key}" for key in facts if key not in wanted]


def _check_downsampling(
    manifest: Manifest, certificate: Certificate, item: ItemEntry, entry: DownsamplingEntry
) -> None:
    facts, about = manifest.tree["decimation"], certificate.about
    assert about is not None
    rate = Fraction(words_of(about.specification).get("sample_rate", 0))
    wanted = downsampling_of(certificate, item, entry, rate)
    for key, value in wanted.items():
        _compare(f"decimation.{key}", facts[key], value)
    manifest.open += [f"decimation.{key}" for key in facts if key not in wanted]


def _check_ahead(manifest: Manifest, facts: Mapping[str, Any] | None, wanted: Mapping[str, Any] | None) -> None:
    if facts is None or wanted is None:
        _compare("decimation.calibration", facts, wanted)
        return
    for key, value in wanted.items():
        _compare(f"decimation.calibration.{key}", facts[key], value)
    manifest.open += [f"decimation.calibration.{key}" for key in facts if key not in wanted]


def _check_reload(manifest: Manifest, certificate: Certificate, item: ItemEntry) -> None:
    facts = manifest.tree["reload"]
    require(
        (facts is not None) == item.reload,
        f"reload in the manifest must be {'there' if item.reload else 'None'}, as in the certificate, "
        f"not {_cut(facts)}",
    )
    if facts is not None:
        files = [f"{certificate.name}_registers.h", f"{certificate.name}.rdl"] if item.reload_registers else []
        _compare("reload.registers", facts["registers"], files)
        manifest.open += [f"reload.{key}" for key in facts if key != "registers"]


def _stream_of(stream: StreamEntry, ports: tuple[PortEntry, ...], item: ItemEntry, *, flags: bool) -> dict[str, Any]:
    stream_facts: dict[str, Any] = {} if not stream.dest_width else {"tdest": {"width": stream.dest_width}}
    stream_facts["width"] = stream.width
    if item.samples > 1:
        stream_facts |= {"samples": item.samples, "sample_width": stream.width // item.samples}
    stream_facts["fields"] = [
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
        stream_facts["tuser"] = {"width": stream.user_width, "flags": dict(item.flags)}
    return stream_facts


def _compare(what: str, stated: Any, wanted: Any) -> None:
    """Compare trees of JSON, whose numbers may be figures."""
    if isinstance(wanted, dict) and isinstance(stated, dict):
        for key in (*wanted, *stated):
            require(
                key in stated and key in wanted,
                f"{what} in the manifest must {'have' if key in wanted else 'not have'} {_cut(key)}",
            )
            _compare(f"{what}.{key}", stated[key], wanted[key])
    elif isinstance(wanted, list) and isinstance(stated, list):
        require(
            len(stated) == len(wanted), f"{what} in the manifest must have {len(wanted)} entries, not {len(stated)}"
        )
        for index, (one, other) in enumerate(zip(stated, wanted, strict=True)):
            _compare(f"{what}[{index}]", one, other)
    else:
        right = wanted.holds if isinstance(wanted, Figure) else _same(wanted)
        require(
            right(stated), f"{what} in the manifest must be {_cut(wanted)}, as in the certificate, not {_cut(stated)}"
        )


def _same(wanted: Any) -> Callable[[Any], bool]:
    return lambda stated: type(stated) is type(wanted) and stated == wanted


def _cut(value: object) -> str:
    text = str(value) if isinstance(value, Figure) else ascii(value)
    text = text.strip("'") if isinstance(value, str) else text
    return text if len(text) <= 200 else f"{text[:200]}.."
