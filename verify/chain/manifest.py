"""The manifest of a chain, every field of which follows from certificates and the specification."""

from __future__ import annotations

import json
from collections.abc import Sequence
from decimal import Decimal
from typing import Any

from sosmith.verify.certificate_file import Certificate, ItemEntry, PortEntry, StreamEntry
from sosmith.verify.chain.chain_file import ChainCertificate
from sosmith.verify.chain.responses import factor_of, parts_of, rise_of
from sosmith.verify.graph import RejectedError, require
from sosmith.verify.specified.words import words_of
from sosmith.verify.verdict.generated_files import about_of, unicode_text


def check_chain_manifest(
    content: bytes,
    chain: ChainCertificate,
    groups: Sequence[tuple[Certificate, ...]],
    items: Sequence[Sequence[ItemEntry]],
) -> None:
    """Check the manifest of a chain.

    Raises
    ------
    RejectedError
        If a field is not what follows.
    """
    try:
        tree = json.loads(unicode_text(f"{chain.name}.json", content), object_pairs_hook=_without_duplicates)
    except (ValueError, RecursionError):
        raise RejectedError("the manifest must be JSON") from None
    wanted = _wanted(chain, groups, items)
    require(isinstance(tree, dict) and [*tree] == [*wanted], f"the manifest must have the fields {', '.join(wanted)}")
    for name, value in wanted.items():
        require(_is_same(tree[name], value), f"{name} of the manifest must be {value}, not {tree[name]}")


def _without_duplicates(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    tree = dict(pairs)
    if len(tree) < len(pairs):
        raise ValueError("a key twice")
    return tree


def _is_same(read: Any, value: Any) -> bool:
    """Compare trees of JSON, in which true is not the number 1."""
    if isinstance(value, dict):
        same = isinstance(read, dict) and read.keys() == value.keys()
        return same and all(_is_same(read[key], value[key]) for key in value)
    if isinstance(value, list):
        return isinstance(read, list) and len(read) == len(value) and all(map(_is_same, read, value))
    return isinstance(read, bool) == isinstance(value, bool) and bool(read == value)


def _wanted(
    chain: ChainCertificate, groups: Sequence[tuple[Certificate, ...]], items: Sequence[Sequence[ItemEntry]]
) -> dict[str, Any]:
    parts = list(map(parts_of, groups))
    whole, first, last = [part for own in parts for part in own], groups[0][0], groups[-1][0]
    return {
        "name": chain.name,
        "core": "chain",
        "sosmith_version": about_of(first).versions["sosmith"],
        "spec": _plain(words_of(chain.specification)),
        "channels": chain.channels,
        "streams": {
            "s_axis": _stream(items[0][0].taken, first.inputs, {}),
            "m_axis": _stream(items[-1][0].given, (last.output,), items[-1][0].flags),
        },
        "stages": [
            {
                "name": entry.name,
                "kind": entry.kind,
                "cores": [core.name for core in cores],
                "architectures": [item.architecture for item in own_items],
                "interpolate": rise_of(own),
                "decimate": factor_of(own),
                "error_bound": float(entry.error),
                "gain_to_the_end": float(entry.gain),
            }
            for entry, cores, own_items, own in zip(chain.stages, groups, items, parts, strict=True)
        ],
        "interpolate": rise_of(whole),
        "decimate": factor_of(whole),
        "settling_results": chain.settling,
        "error_bound": float(chain.bound),
        "error_parts": {entry.name: float(entry.error * entry.gain) for entry in chain.stages},
        "error_unit": chain.output.unit,
    }


def _stream(stream: StreamEntry, ports: Sequence[PortEntry], flags: dict[str, int]) -> dict[str, Any]:
    dest = {"tdest": {"width": stream.dest_width}} if stream.dest_width else {}
    user = {"tuser": {"width": stream.user_width, "flags": flags}} if flags else {}
    fields = [
        {
            "name": field.name,
            "offset": field.offset,
            "width": field.width,
            "signed": field.signed,
            "lsb": float(field.lsb),
            "zero": float(field.zero),
            "unit": port.unit,
        }
        for field, port in zip(stream.fields, ports, strict=True)
    ]
    return dest | {"width": stream.width, "fields": fields} | user


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_plain(item) for item in value]
    return float(value) if isinstance(value, Decimal) else value
