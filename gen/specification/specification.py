"""The specification: a TOML file in physical units, read exactly and checked before anything is built.

Every number stays exact (`Fraction`) as written. Values that are known but not supported yet are refused by name.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from decimal import Decimal
from fractions import Fraction
from functools import cached_property
from pathlib import Path
from typing import Any

from sosmith.gen.specification.choices import CALIBRATION_INPUTS, FIR, FIR_FAMILIES
from sosmith.gen.specification.converters import ConverterSpec, converters, dac
from sosmith.gen.specification.rules import check
from sosmith.gen.specification.schema import Document, FilterTable, InputTable, OutputTable, UncertaintyTable, parse
from sosmith.gen.specification.toml_text import toml_text
from sosmith.gen.specification.uncertainty import CoefficientsSpec, UncertaintySpec
from sosmith.gen.specification.values import UnfitError, literal
from sosmith.gen.specification.wear_limits import WearSpec
from sosmith.model.converters.dac_writing import Writing
from sosmith.model.dataflow.cic import order_of
from sosmith.model.errors import SpecificationError
from sosmith.model.foreign_files import read_text
from sosmith.model.port import Port
from sosmith.model.tables.toml_file import parse_toml

MAX_BYTES = 1 << 16
"""Maximum size of a specification in bytes; typical ones have one or two thousand."""

STAGE = "stage"
"""Key of the stages of a chain, whose specification is of another shape: `sosmith.gen.chain.specification`."""

SECTIONS = "sections"
"""Default family, kind and method of a filter that is given by its sections."""

_UNITS = {"voltage": "V", "temperature": "degC"}


@dataclass(frozen=True, kw_only=True)
class CalibrationSpec:
    """Calibration polynomial d = sum of a[i][j] * voltage**i * temperature**j; one attribute is None.

    Attributes
    ----------
    coefficients : tuple of tuples of Fraction or None
        1 to 8 rows of 1 to 8 numbers a[i][j], not all zero; i is the power of the voltage (V), j that of
        the temperature (degC). Rows may differ in length.
    data : Path or None
        CSV file of measurements to fit the polynomial to; relative to the folder of the specification.
    uncertainty : CoefficientsSpec or None
        What the coefficients are worth, if it is stated.
    """

    coefficients: tuple[tuple[Fraction, ...], ...] | None
    data: Path | None
    uncertainty: CoefficientsSpec | None = None

    @property
    def has_uncertainty(self) -> bool:
        """Whether anything says what the coefficients are worth: measurements, or what is stated."""
        return self.data is not None or self.uncertainty is not None


@dataclass(frozen=True, kw_only=True)
class FilterSpec:
    """The required filter: by `order` and `cutoff`, edges and losses, sections, or taps; the other attributes are None.

    Attributes
    ----------
    family, kind, method : str
        For example "butterworth", "lowpass", "bilinear". With `sos` they are only a label, "sections" by
        default; with `taps` they are "fir", as is the method of a designed FIR filter.
    order : int or None
        Order of the prototype, 1 to 20; for bandpass and bandstop 1 to 10, as the filter has twice that order.
    cutoff, passband_edge, stopband_edge : tuple of Fraction or None
        In Hz, one for lowpass and highpass, two rising ones for bandpass and bandstop, all of them at least a
        millionth of the sample rate away from 0 and from half the sample rate, behind a decimator of that of the
        filter away from 0.
    passband_loss, stopband_loss : Fraction or None
        In dB, 1e-6 to 200, the first below the second. With `order` and `cutoff`, only those that the family
        needs.
    sos : tuple of tuples of Fraction or None
        1 to 10 stable rows (b0, b1, b2, a0, a1, a2) with a0 = 1 and the sign convention of scipy; of the
        specification or of its `sos_file`.
    taps : tuple of Fraction or None
        1 to 512 coefficients of 1, 1/z and so on, not all 0; of the specification or of its `taps_file`.
    decimate : int, "auto" or None
        Factor of the decimator before a low-pass filter by order and cutoff, a power of two; None without one.
    hold : bool
        Whether each result behind a decimator is handed out once for each of its samples, at their rate.
    freedom : str
        "mask" for any filter that keeps to edges and losses, with coefficients of few digits; "none" for that of the
        family.
    origin : str
        How `sos_file` or `taps_file` was read, a sentence; empty without one.
    """

    family: str
    kind: str
    method: str
    order: int | None
    cutoff: tuple[Fraction, ...] | None
    passband_edge: tuple[Fraction, ...] | None
    stopband_edge: tuple[Fraction, ...] | None
    passband_loss: Fraction | None
    stopband_loss: Fraction | None
    sos: tuple[tuple[Fraction, ...], ...] | None
    taps: tuple[Fraction, ...] | None = None
    origin: str = ""
    decimate: int | str | None = None
    hold: bool = False
    freedom: str = "none"

    @property
    def is_fir(self) -> bool:
        """Whether it is an FIR filter, whose realizations are others than those of second-order sections."""
        return self.taps is not None or self.family in FIR_FAMILIES

    @cached_property
    def is_cic(self) -> bool:
        """Whether it decimates by as many samples as each of its moving sums takes: then adders alone can make it."""
        factor = self.decimate if isinstance(self.decimate, int) else 1
        return self.taps is not None and order_of(self.taps, factor) is not None


@dataclass(frozen=True, kw_only=True)
class HardwareSpec:
    """How the datapath is built.

    Attributes
    ----------
    realization : str
        "auto" or a key of `sosmith.gen.realizations.registry.REALIZATIONS`.
    architecture : str
        "auto" or a key of `sosmith.gen.specification.combinations.TERMS`.
    clock : Fraction
        In Hz, at least the sample rate.
    reload : bool
        Whether coefficients can be loaded at run time.
    protect : str
        One of `sosmith.model.dataflow.protection.PROTECTIONS`.
    start : str
        "steady" if the filter starts from the steady state of its first sample, "zero" if from states of 0.
    multipliers : int or None
        Multiplier blocks that the parallel architecture may take, where the rest is made of adders; None for as many
        as the board has, or as synthesis makes. With 2 or more, the folded one has two products a clock, otherwise one.
    pipeline : str
        "plain", "look-ahead", or "auto" for look-ahead only where clock and sample rate ask for it.
    samples_per_clock : int
        Samples in a beat of the streams, one of `sosmith.gen.specification.choices.SAMPLES_PER_CLOCK`.
    keep : bool
        Whether nets with names stay through synthesis, for a logic analyser.
    reload_lock : bool
        Whether loading can be locked until a reset.
    reload_registers : bool
        Whether a core whose coefficients can be loaded has registers for that; otherwise pins, for registers elsewhere.
    """

    realization: str
    architecture: str
    clock: Fraction
    reload: bool
    protect: str
    start: str
    multipliers: int | None = None
    pipeline: str = "auto"
    samples_per_clock: int = 1
    keep: bool = False
    reload_lock: bool = False
    reload_registers: bool = True


@dataclass(frozen=True, kw_only=True)
class Specification:
    """A checked specification.

    Attributes
    ----------
    path : Path
        File that the specification was read from.
    source : dict
        The file as read, in the types of JSON, for the manifest.
    text : str
        The file's text, TOML; of a specification that does not come from a file, a text with the same values.
    name : str
        Name of the top module and of the files: a Verilog identifier.
    sample_rate : Fraction
        In Hz, of each channel.
    channels : int
        Number of channels.
    inputs : tuple of Port
        Voltage (V) and temperature (degC), always in this order; without
        `calibration` the one input of the filter, in the unit of the output.
    calibration : CalibrationSpec or None
        None for a plain filter.
    filter : FilterSpec
        The filter.
    output : Port
        The result, "clearance" with `calibration` and "y" without.
    max_error : Fraction
        Largest allowed |hardware - exact|, in the unit of the output, more than half an LSB of the output.
    wear : WearSpec or None
        Wear limits, for the wear flags.
    uncertainty : UncertaintySpec or None
        What is known of the instrument's errors; the hardware does not depend on it.
    hardware : HardwareSpec
        The hardware.
    converters : tuple of ConverterSpec
        What a board reads each input from; empty if samples come over the link.
    dac : Writing or None
        How a board writes results to a DAC; None without one.
    """

    path: Path
    source: dict[str, Any]
    text: str
    name: str
    sample_rate: Fraction
    channels: int
    inputs: tuple[Port, ...]
    calibration: CalibrationSpec | None
    filter: FilterSpec
    output: Port
    max_error: Fraction
    wear: WearSpec | None
    uncertainty: UncertaintySpec | None = None
    hardware: HardwareSpec
    converters: tuple[ConverterSpec, ...] = ()
    dac: Writing | None = None


def load(path: Path) -> Specification:
    """Read and check the specification in the file `path`.

    Raises
    ------
    SpecificationError
        For all errors, in a sentence each: the file, the path of the key or the line, what was expected and what
        was found. Rules about several keys are checked once each key is right, and one of a subject is reported.
    """
    return from_text(text_of(path), path)


def from_text(text: str, path: Path) -> Specification:
    """Check the specification with the TOML `text`; path and errors as for `from_tree`."""
    return replace(from_tree(parsed(text, path), path), text=text)


def parsed(text: str, path: Path) -> dict[str, Any]:
    """Return the tree of the TOML `text`, with every float as `decimal.Decimal`.

    Raises
    ------
    SpecificationError
        If it is not TOML, or empty.
    """
    tree = parse_toml(text, str(path), what="the specification", parse_float=Decimal)
    if not tree:
        raise SpecificationError(f"{path}: the specification must have keys, not be empty")
    return tree


def text_of(path: Path) -> str:
    """Return the text of a specification file.

    Raises
    ------
    SpecificationError
        If it cannot be read.
    """
    return read_text(path, what="the specification", max_bytes=MAX_BYTES)


def from_tree(tree: dict[str, Any], path: Path) -> Specification:
    """Check a specification that has already been read.

    Parameters
    ----------
    tree : dict
        As `tomllib` gives it, with every float as `decimal.Decimal`.
    path : Path
        Its name in messages; `calibration.data` is relative to the folder of this path.

    Raises
    ------
    SpecificationError
        As `load`.
    """
    try:
        if STAGE in tree:
            raise UnfitError(
                "left out here, as only board, build, design, explore, generate, package, reload, simulate and "
                "verify take a chain: `sosmith generate` writes a specification of each stage beside the chain's "
                "files, for what takes a single core",
                literal(tree[STAGE]),
                where=STAGE,
                later=True,
            )
        document = parse(tree)
        check(document)
        return _specification(path, tree, document)
    except UnfitError as unfit:
        raise SpecificationError(f"{path}: {unfit}") from None


def example() -> str:
    """Return the commented example specification, TOML."""
    return Path(__file__).with_name("example.toml").read_text(encoding="utf-8")


def _specification(path: Path, tree: dict[str, Any], document: Document) -> Specification:
    output = document.output
    calibrated = document.calibration is not None
    output_port = _port("clearance" if calibrated else "y", output, output.unit)
    hardware, wear = document.hardware, document.wear
    inputs = tuple(
        _port(name, document.input[name], _UNITS[name] if calibrated else output.unit)
        for name in (CALIBRATION_INPUTS if calibrated else document.input)
    )
    return Specification(
        path=path,
        source={key: to_json(value) for key, value in tree.items()},
        text=toml_text(tree),
        name=document.name,
        sample_rate=document.sample_rate,
        channels=document.channels,
        inputs=inputs,
        calibration=_calibration(path, document),
        filter=_filter(path, document.filter),
        output=output_port,
        max_error=output_port.lsb if output.max_error is None else output.max_error,
        wear=None
        if wear is None
        else WearSpec(initial=wear.initial, warning=wear.warning, limit=wear.limit, sensor_range=wear.sensor_range),
        uncertainty=None if document.uncertainty is None else _uncertainty(document.uncertainty),
        hardware=HardwareSpec(
            realization=hardware.realization,
            architecture=hardware.architecture,
            clock=hardware.clock,
            reload=hardware.reload,
            protect=hardware.protect,
            start=hardware.start,
            multipliers=hardware.multipliers,
            pipeline=hardware.pipeline,
            samples_per_clock=hardware.samples_per_clock,
            keep=hardware.keep,
            reload_lock=hardware.reload_lock,
            reload_registers=hardware.reload_registers,
        ),
        converters=converters(inputs, document.converter),
        dac=dac(inputs, output_port, document.converter),
    )


def to_json(value: Any) -> Any:
    """Return a value of a specification in the types of JSON."""
    match value:
        case dict():
            return {key: to_json(item) for key, item in value.items()}
        case list():
            return [to_json(item) for item in value]
        case Decimal():
            return float(value)
        case _:
            return value


def _port(name: str, table: InputTable | OutputTable, unit: str) -> Port:
    low, high = table.range
    return Port.from_range(name, table.bits, low, high, signed=table.signed, unit=unit)


def _calibration(path: Path, document: Document) -> CalibrationSpec | None:
    calibration = document.calibration
    if calibration is None:
        return None
    return CalibrationSpec(
        coefficients=calibration.coefficients,
        data=None if calibration.data is None else path.parent / calibration.data,
        uncertainty=None if calibration.uncertainty is None else CoefficientsSpec(**vars(calibration.uncertainty)),
    )


def _uncertainty(table: UncertaintyTable) -> UncertaintySpec:
    motion = tuple((frequency, amplitude) for frequency, amplitude in table.motion)
    return UncertaintySpec(**vars(table) | {"motion": motion})


def _filter(path: Path, table: FilterTable) -> FilterSpec:
    sections, origin = table.sos, ""
    if table.sos_file is not None:
        from sosmith.gen.specification.sections_file import sections_of  # only a file of arrays needs numpy

        sections, origin = sections_of(path.parent / table.sos_file)
    taps = table.taps
    if table.taps_file is not None:
        from sosmith.gen.specification.taps_file import taps_of

        taps, origin = taps_of(path.parent / table.taps_file)
    label = SECTIONS if taps is None else FIR
    designed = table.family in FIR_FAMILIES
    method = FIR if designed else label if sections is not None or taps is not None else "bilinear"
    return FilterSpec(
        family=table.family or label,
        kind=table.kind or label,
        method=table.method or method,
        order=table.order,
        cutoff=table.cutoff,
        passband_edge=table.passband_edge,
        stopband_edge=table.stopband_edge,
        passband_loss=table.passband_loss,
        stopband_loss=table.stopband_loss,
        sos=sections,
        taps=taps,
        origin=origin,
        decimate=table.decimate,
        hold=table.hold,
        freedom=table.freedom,
    )
