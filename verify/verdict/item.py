"""What the item of a certificate is: held against the certificate, the specification, the files and the SystemVerilog.

The entry decides which proof the hardware needs. It is held against the parts of the certificate that are proven.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from fractions import Fraction
from typing import Any

from sosmith.verify.certificate_file import Certificate, FieldEntry, ItemEntry, PortEntry, StreamEntry
from sosmith.verify.graph import RejectedError, require
from sosmith.verify.reader.syntax import Module
from sosmith.verify.specified.calibration_fit import Refit
from sosmith.verify.specified.words import table_of

_BYTE = 8
_STATUS = {
    "input_at_rail": 0,
    "outside_calibration": 1,
    "output_saturated": 2,
    "wear_warning": 3,
    "wear_critical": 4,
    "settling": 5,
    "fault": 6,
}
_LINES = {
    "aclk": ("input", 1),
    "aresetn": ("input", 1),
    "s_axis_tvalid": ("input", 1),
    "s_axis_tready": ("output", 1),
    "m_axis_tvalid": ("output", 1),
    "m_axis_tready": ("input", 1),
}


def core_of(certificate: Certificate) -> str:
    """Return which part of an instrument a certificate is about, from what it proves."""
    if certificate.ideal.polynomial is None:
        return "filter"
    return "instrument" if certificate.ideal.sections else "calibration"


def start_of(certificate: Certificate) -> str:
    """Return how a filter starts: from its first sample, or from zero."""
    down = certificate.downsampling
    return "steady" if down is not None and down.filled else certificate.ideal.start or "zero"


def check_item(certificate: Certificate, item: ItemEntry) -> None:
    """Check that what a certificate says of its item agrees with what it proves.

    Raises
    ------
    RejectedError
        For the first disagreement.
    """
    entry = certificate.decimation
    _same("core", item.core, core_of(certificate))
    if certificate.about is not None and "core" in certificate.about.options:
        _same("core", certificate.about.options["core"], item.core)
    _same("start", item.start, start_of(certificate))
    _same("architecture", item.architecture == "online", certificate.claims.online is not None, "online")
    _same("ahead", item.ahead is not None, entry is not None and entry.calibration is not None, "there")
    down = certificate.downsampling
    lowers = entry is not None or (down is not None and down.factor > 1)
    plain = item.architecture == "folded" and not item.reload and item.protect == "none" and not item.keep
    require(
        not item.shared or (plain and down is not None and down.factor == 1),
        "hardware for several results must be folded, of filters with fixed taps and no check bits",
    )
    require(lowers or not item.hold, "hold of the item must not be stated without a decimator")
    require(item.channels == 1 or item.samples == 1, "several samples a clock must be those of one channel")
    _same("flags", [*item.flags.items()], [*_STATUS.items()])
    _check_codes(certificate, item)
    dest = -(-(item.channels - 1).bit_length() // _BYTE) * _BYTE
    _check_stream("taken", item.taken, certificate.inputs, item.samples, dest, 0)
    _check_stream("given", item.given, (certificate.output,), item.samples, dest, _BYTE * item.samples)


def _check_codes(certificate: Certificate, item: ItemEntry) -> None:
    if item.calibrated:
        require(len(item.calibrated) == len(certificate.inputs), "calibrated of the item must have codes of each input")
        require(certificate.ideal.polynomial is not None, "calibrated of the item must be empty without a calibration")
        for port, (low, high) in zip(certificate.inputs, item.calibrated, strict=True):
            require(
                port.lowest <= low <= high <= port.highest,
                f"calibrated of the item must be codes of {port.name}, not {low}..{high}",
            )
    require(
        len(item.wear) in {0, 1, item.channels},
        f"wear of the item must be that of all channels or of each of {item.channels}, not of {len(item.wear)}",
    )
    for warning, critical in item.wear:
        require(
            certificate.output.lowest < warning < critical <= certificate.output.highest,
            f"wear of the item must be codes of the output that rise, not {warning} and {critical}",
        )


def _check_stream(
    name: str, stream: StreamEntry, ports: tuple[PortEntry, ...], samples: int, dest: int, user: int
) -> None:
    offset, fields = 0, []
    for port in ports:
        fields.append(
            FieldEntry(name=port.name, offset=offset, width=port.bits, signed=port.signed, lsb=port.lsb, zero=port.zero)
        )
        offset += -(-port.bits // _BYTE) * _BYTE
    wanted = {"width": offset * samples, "dest_width": dest, "user_width": user, "fields": tuple(fields)}
    for key, value in wanted.items():
        _same(f"{key} of {name}", getattr(stream, key), value)


def _same(what: str, stated: object, proven: object, state: str = "") -> None:
    if state:
        require(
            stated == proven, f"{what} of the item must {'' if proven else 'not '}be {state}, as in the certificate"
        )
    require(stated == proven, f"{what} of the item must be {proven}, as in the certificate, not {stated}")


def check_stated(certificate: Certificate, item: ItemEntry, tree: Mapping[str, Any], refit: Refit | None) -> None:
    """Check an item against the words of a specification, as a tree of TOML, and what its measurements determine.

    Raises
    ------
    RejectedError
        For the first disagreement.
    """
    hardware: Mapping[str, Any] = table_of(tree, "hardware")
    filter_: Mapping[str, Any] = table_of(tree, "filter")
    covered = () if refit is None else refit.codes(certificate.inputs)
    everything = tuple((port.lowest, port.highest) for port in certificate.inputs)
    stated: dict[str, object] = {
        "channels": tree.get("channels", 1),
        "protect": hardware.get("protect", "none"),
        "reload": hardware.get("reload", False),
        "keep": hardware.get("keep", False),
        "reload_lock": hardware.get("reload_lock", False),
        "reload_registers": hardware.get("reload_registers", True),
        "samples": hardware.get("samples_per_clock", 1),
        "calibrated": () if covered == everything else covered,
        "wear": _wear_codes(table_of(tree, "wear"), certificate.output),
    }
    if item.core != "calibration":
        stated |= {"start": hardware.get("start", "steady"), "hold": filter_.get("hold", False)}
    architecture = hardware.get("architecture", "auto")
    if architecture != "auto":
        stated["architecture"] = architecture
    for key, value in stated.items():
        own = getattr(item, key)
        require(own == value, f"{key} of the item must be {value}, as specified, not {own}")


def _wear_codes(table: Mapping[str, Any], output: PortEntry) -> tuple[tuple[int, int], ...]:
    """Return the lowest codes at which wear is a warning and critical; one pair if all channels have the same."""
    pairs = [
        (math.ceil((warning - output.zero) / output.lsb), math.ceil((critical - output.zero) / output.lsb))
        for warning, critical in wear_limits(table)
    ]
    return tuple(pairs[:1] if len(set(pairs)) == 1 else pairs)


def wear_limits(table: Mapping[str, Any]) -> list[tuple[Fraction, Fraction]]:
    """Return the clearances of ``[wear]`` at which wear is a warning and critical: of all channels, or of each.

    Raises
    ------
    RejectedError
        If a word is missing, or no number.
    """
    if not table:
        return []
    try:
        words = table["initial"]
        initial = [Fraction(word) for word in (words if isinstance(words, list) else [words])]
        warning, limit = Fraction(table["warning"]), Fraction(table["limit"])
        ends = [limit + each for each in initial]
        if "sensor_range" in table:
            ends = [min(end, Fraction(table["sensor_range"])) for end in ends]
    except (KeyError, TypeError, ValueError, OverflowError):
        raise RejectedError("wear of the specification must be its limits") from None
    return [(each + warning, end) for each, end in zip(initial, ends, strict=True)]


_COMPARED = {
    "": {"name", "sample_rate", "channels", "input", "output", "calibration", "filter", "wear", "hardware"},
    "calibration": {"coefficients", "data"},
    "hardware": {
        *("architecture", "keep", "protect", "samples_per_clock", "start"),
        *("reload", "reload_lock", "reload_registers"),
    },
}
"""Keys of a specification's tables that are held against something; those of other tables are all compared."""


def not_compared(tree: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the keys of a specification that nothing is held against, but for those that leave the choice open."""
    keys = [key for key in tree if key not in _COMPARED[""]]
    for name in ("calibration", "hardware"):
        table = table_of(tree, name)
        keys += [f"{name}.{key}" for key in table if key not in _COMPARED[name] and table[key] != "auto"]
    return tuple(keys)


def whole_core(tree: Mapping[str, Any]) -> str:
    """Return what a specification describes as a whole."""
    if "calibration" not in tree:
        return "filter"
    return "instrument" if "filter" in tree else "calibration"


def file_names(name: str, item: ItemEntry | None) -> list[str]:
    """Return the names of the files that are written with a certificate, in their order."""
    there = item is not None and item.reload and item.reload_registers
    registers = ["_registers.h", ".rdl"] if there else []
    hardware = [] if item is not None and item.shared else [".sv", ".il"]
    return [f"{name}{end}" for end in (*hardware, ".json", ".c", ".h", *registers)]


def check_ports(top: Module, item: ItemEntry) -> None:
    """Check the ports of a core: every one, its direction and its width.

    Raises
    ------
    RejectedError
        If one is missing, superfluous, or of another width.
    """
    wanted = dict(_LINES)
    wanted["s_axis_tdata"] = ("input", item.taken.width)
    wanted["m_axis_tdata"] = ("output", item.given.width)
    wanted["m_axis_tuser"] = ("output", item.given.user_width)
    if item.taken.dest_width:
        wanted["s_axis_tdest"] = ("input", item.taken.dest_width)
        wanted["m_axis_tdest"] = ("output", item.given.dest_width)
    ports = {name: (direction, top.widths[name]) for name, direction in top.ports.items()}
    if item.reload:  # the port that loads constants is not read further
        begins = "s_axil_" if item.reload_registers else "reload_"
        ports = {name: port for name, port in ports.items() if not name.startswith(begins)}
    for name in sorted({*wanted, *ports}):
        require(name in wanted, f"the port {name} must not be there")
        require(name in ports, f"the port {name} must be there")
        said, read = (f"{direction} of {width} bits" for direction, width in (wanted[name], ports[name]))
        require(said == read, f"the port {name} must be an {said}, not an {read}")
