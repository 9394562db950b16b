"""The command `import`: a specification with the filter of another tool's file."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from sosmith.commands.options import OneOf
from sosmith.output_paths import output_option
from sosmith.terminal import note


@click.command("import")
@click.argument("file", type=click.Path(path_type=Path))
@click.option(
    "--sample-rate", type=click.FloatRange(min=0, min_open=True), required=True, help="Samples per second, in Hz."
)
@click.option(
    "--signs",
    type=OneOf(["auto", "scipy", "negated"]),
    default="auto",
    show_default=True,
    help="Signs of a1 and a2 in FILE: 'scipy' has 1 + a1/z + a2/z^2 in the denominator, 'auto' takes the stable one.",
)
@click.option("--name", help="Name of the specification.  [default: from the name of the file]")
@click.option("--channels", type=int, default=1, show_default=True, help="Channels that share the hardware.")
@click.option("--bits", type=int, default=16, show_default=True, help="Bits of the input.")
@click.option("--output-bits", type=int, help="Bits of the output.  [default: those of the input]")
@click.option(
    "--range",
    "ends",
    type=(float, float),
    default=(-1.0, 1.0),
    show_default=True,
    metavar="LOW HIGH",
    help="Physical range of input and output.",
)
@click.option("--unit", default="", help="Unit of input and output.")
@output_option("File of the specification.  [default: print it]", stdout=True)
def import_command(
    file: Path,
    sample_rate: float,
    signs: Any,
    name: str | None,
    channels: int,
    bits: int,
    output_bits: int | None,
    ends: tuple[float, float],
    unit: str,
    output: Path | None,
) -> None:
    """Write a specification with the filter of another tool's FILE.

    FILE is recognized by its content: sos arrays of NumPy (.npy, .npz), MATLAB's SOS and G (.mat) and the exported text
    of its filter designer, pyfda's .sos, .csv, .npz and .json, CMSIS-DSP's five columns, biquad lists as from Room EQ
    Wizard and miniDSP, an analog prototype (.toml) with zeros, poles and gain in rad/s, or the taps of an FIR filter in
    one row or column.

    Says on stderr how the file was read: tools disagree on the signs of a1 and a2. Of the two choices, the stable one
    is taken, and its gains at 0 Hz and at half the sample rate are shown.

    \b
        sosmith import equalizer.txt --sample-rate 48000 -o equalizer.toml
        sosmith design equalizer.toml
    """
    from sosmith.interface.choices import identifier_from
    from sosmith.interface.coefficients import Coefficients
    from sosmith.interface.files import write_file

    read = Coefficients.load(file, sample_rate=sample_rate, signs=signs)
    text = read.specification(
        name=name or identifier_from(file.stem),
        channels=channels,
        input_bits=bits,
        output_bits=output_bits,
        input_range=ends,
        unit=unit,
    ).toml()
    for line in read.notes:
        note(line)
    at_zero, at_half = read.gains
    note(f"gain {at_zero:.6g} at 0 Hz, {at_half:.6g} at {sample_rate / 2:g} Hz")
    if output is None:
        click.echo(text, nl=False)
    else:
        write_file(output, text)
        click.echo(output)
