"""Specifications with one fault each, and the sentences that refuse them."""

from __future__ import annotations

from sosmith.gen.specification.choices import REALIZATIONS

BASE = """\
name = "demo"
sample_rate = 100.0

[input.voltage]
bits = 16
range = [0.0, 10.0]
[input.temperature]
bits = 12
range = [-32.0, 96.0]

[calibration]
coefficients = [[1.16, -0.0036], [0.3672]]

[filter]
family = "butterworth"
kind = "lowpass"
order = 7
cutoff = 10.0

[output]
bits = 16
range = [0.0, 16.0]
unit = "mm"

[hardware]
clock = 12.0e6
"""


NAME = 'name = "demo"'


RATE = "sample_rate = 100.0"


VOLT = "bits = 16\nrange = [0.0, 10.0]"


OUT = "bits = 16\nrange = [0.0, 16.0]"


COEF = "coefficients = [[1.16, -0.0036], [0.3672]]"


FAM = 'family = "butterworth"'


KIND = 'kind = "lowpass"'


ORD = "order = 7"


CUT = "cutoff = 10.0"


OC = "order = 7\ncutoff = 10.0"


CLOCK = "clock = 12.0e6"


UNIT = 'unit = "mm"'


FILTER = BASE[BASE.index("[filter]") : BASE.index("[output]")]


CAL = BASE[BASE.index("[calibration]") : BASE.index("[filter]")]


TEMP = BASE[BASE.index("[input.temperature]") : BASE.index("[calibration]")]


KO = f"{KIND}\n{OC}"


ADC = "\n[converter.voltage]\ndevice = 'mcp3204'\nrange = {}"


THERMOCOUPLE = "\n[converter.temperature]\ndevice = 'max31855'"


DEVICES = "mcp3202, mcp3204, max31855, ad7476a, pcm1808, cs5343, pcm5102a, cs4344, mcp4921"


DECIMATED = "\n# decimated\n"
"""Stands for `filter.decimate`, which is in another table."""


EDGES = "passband_edge = {}\nstopband_edge = {}\npassband_loss = {}\nstopband_loss = {}"


# Phrases that stand in several sentences.
TABLES = (
    "one of the keys name, sample_rate, channels, input, calibration, filter, output, wear, uncertainty, converter, "
    "hardware, not an unknown one"
)


FILTER_KEYS = (
    "one of the keys family, kind, method, order, cutoff, passband_edge, stopband_edge, passband_loss,"
    " stopband_loss, freedom, sos, sos_file, taps, taps_file, decimate, hold, not an unknown one"
)


IDENTIFIER = "a Verilog identifier of at most 64 letters, digits and underscores"


IN_PROPORTION = "a number of at most 130 digits, zero or from 1e-30 to below 1e30 in size"


FAMILIES = "one of butterworth, chebyshev1, chebyshev2, elliptic, bessel, equiripple, least_squares, kaiser, halfband"


FORMS = (
    "given by order and cutoff, by passband_edge, stopband_edge, passband_loss and stopband_loss, "
    "by one of sos and sos_file, or by one of taps and taps_file"
)


MARGIN = (
    "at least a millionth of the sample_rate (0.0001 Hz) away from 0 and from half the sample_rate,"
    " as no word length suffices for a filter closer to them"
)


NYQUIST = "above 0 and below half the sample_rate (50 Hz)"


STABLE = "a stable section, |a2| < 1 and |a1| < 1 + a2"


MAX_ERROR = 'a positive number in the unit of the output, or "faithful"'


REASON = "the specification must be TOML within reason, not lists some hundred deep or a number too long to read"


# Subject, what is replaced in BASE, what it is replaced by, and the answer after the name of the file.
BAD = [
    (
        "unknown key",
        "order = 7",
        "order = 7\ncutof = 3.0",
        f"filter.cutof must be {FILTER_KEYS} (did you mean cutoff?)",
    ),
    (
        "unknown key close to none",
        UNIT,
        UNIT + "\nzzz = 1",
        "output.zzz must be one of the keys bits, range, signed, unit, max_error, not an unknown one",
    ),
    ("unknown table", "[hardware]", "[hardwear]", f"hardwear must be {TABLES} (did you mean hardware?)"),
    (
        "unknown key at the top",
        RATE,
        RATE + "\nsampling_rate = 3",
        f"sampling_rate must be {TABLES} (did you mean sample_rate?)",
    ),
    (
        "unknown key of an input",
        VOLT,
        VOLT + "\nsign = true",
        "input.voltage.sign must be one of the keys bits, range, signed, not an unknown one (did you mean signed?)",
    ),
    ("key with a blank", NAME, NAME + '\n"a b" = 1', f"'a b' must be {TABLES}"),
    (
        "several",
        RATE,
        "sample_rate = -1\nchannel = 1",
        f"sample_rate must be a positive number of Hz, not -1\n  channel must be {TABLES} (did you mean channels?)",
    ),
    (
        "several, the first in the file",
        RATE,
        "channels = 0\nsample_rate = -1",
        "channels must be a whole number from 1 to 65536, not 0\n  sample_rate must be a positive number of Hz, not -1",
    ),
    (
        "several, the first in its table",
        VOLT,
        "range = [10.0, 0.0]\nbits = 1",
        "input.voltage.range must be rising, [low, high], not [10.0, 0.0]\n"
        "  input.voltage.bits must be a whole number from 2 to 32, not 1",
    ),
    ("missing name", NAME + "\n", "", f"name must be {IDENTIFIER}, not missing"),
    ("missing sample rate", RATE + "\n", "", "sample_rate must be a positive number of Hz, not missing"),
    ("missing filter", FILTER, "", "filter must be a table [filter], not missing"),
    (
        "missing range",
        VOLT,
        "bits = 16",
        "input.voltage.range must be a list of 2 numbers, [low, high], not missing",
    ),
    (
        "missing bits",
        VOLT,
        "range = [0.0, 10.0]",
        "input.voltage.bits must be a whole number from 2 to 32, not missing",
    ),
    ("missing family", FAM + "\n", "", f"filter.family must be {FAMILIES}, not missing"),
    (
        "missing kind",
        KIND + "\n",
        "",
        "filter.kind must be one of lowpass, highpass, bandpass, bandstop, not missing",
    ),
    ("missing cutoff", CUT + "\n", "", "filter.cutoff must be given together with order, not missing"),
    ("name is a number", NAME, "name = 5", f"name must be {IDENTIFIER}, not 5"),
    ("name starts with a digit", NAME, 'name = "9lives"', f"name must be {IDENTIFIER}, not '9lives'"),
    ("name with a dollar", NAME, 'name = "a$b"', f"name must be {IDENTIFIER}, not 'a$b'"),
    ("name with a line break", NAME, 'name = "a\\nb"', f"name must be {IDENTIFIER}, not 'a\\nb'"),
    (
        "name is a word that tools obey",
        NAME,
        'name = "Verilator"',
        f"name must be {IDENTIFIER}, and no word that tools obey in comments, not 'Verilator'",
    ),
    (
        "name is a keyword",
        NAME,
        'name = "module"',
        f"name must be {IDENTIFIER}, and no keyword of SystemVerilog, not 'module'",
    ),
    (
        "name is too long",
        NAME,
        f'name = "{"n" * 65}"',
        f"name must be {IDENTIFIER}, not 'nnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnn ...",
    ),
    ("name is empty", NAME, 'name = ""', f"name must be {IDENTIFIER}, not ''"),
    ("name is not ASCII", NAME, 'name = "µm"', f"name must be {IDENTIFIER}, not 'µm'"),
    (
        "sample rate is a text",
        RATE,
        'sample_rate = "100"',
        "sample_rate must be a positive number of Hz, not '100': write 100, without quotes and unit",
    ),
    (
        "sample rate is a bool",
        RATE,
        "sample_rate = true",
        "sample_rate must be a positive number of Hz, not true",
    ),
    ("sample rate is zero", RATE, "sample_rate = 0", "sample_rate must be a positive number of Hz, not 0"),
    ("sample rate is NaN", RATE, "sample_rate = nan", "sample_rate must be a finite number, not nan"),
    (
        "sample rate is infinite",
        RATE,
        "sample_rate = -inf",
        "sample_rate must be a finite number, not -infinity",
    ),
    (
        "sample rate is a date",
        RATE,
        "sample_rate = 2024-01-01",
        "sample_rate must be a positive number of Hz, not a date",
    ),
    (
        "sample rate is a table",
        RATE,
        "sample_rate = { hz = 100 }",
        "sample_rate must be a positive number of Hz, not a table",
    ),
    (
        "number out of proportion",
        RATE,
        "sample_rate = 1e999999999",
        f"sample_rate must be {IN_PROPORTION}, not 1e+999999999",
    ),
    ("exponent of a score of digits", RATE, "sample_rate = 1e99999999999999999999", f"{REASON}"),
    ("large number", RATE, "sample_rate = 1e30", f"sample_rate must be {IN_PROPORTION}, not 1e+30"),
    ("tiny number", RATE, "sample_rate = 1e-31", f"sample_rate must be {IN_PROPORTION}, not 1e-31"),
    (
        "number of 131 digits",
        RATE,
        f"sample_rate = 1.{'3' * 130}",
        f"sample_rate must be {IN_PROPORTION}, not 1.3333333333333333",
    ),
    (
        "whole number of 20000 bits",
        RATE,
        f"sample_rate = 0x1{'0' * 5000}",
        f"sample_rate must be {IN_PROPORTION}, not a whole number of 20001 bits",
    ),
    ("no channel", RATE, RATE + "\nchannels = 0", "channels must be a whole number from 1 to 65536, not 0"),
    (
        "half a channel",
        RATE,
        RATE + "\nchannels = 1.5",
        "channels must be a whole number from 1 to 65536, not 1.5",
    ),
    (
        "bits with a point",
        VOLT,
        "bits = 16.0\nrange = [0.0, 10.0]",
        "input.voltage.bits must be a whole number from 2 to 32, not 16.0",
    ),
    (
        "one bit",
        VOLT,
        "bits = 1\nrange = [0.0, 10.0]",
        "input.voltage.bits must be a whole number from 2 to 32, not 1",
    ),
    (
        "33 bits",
        OUT,
        "bits = 33\nrange = [0.0, 16.0]",
        "output.bits must be a whole number from 2 to 32, not 33",
    ),
    (
        "falling range",
        VOLT,
        "bits = 16\nrange = [10.0, 0.0]",
        "input.voltage.range must be rising, [low, high], not [10.0, 0.0]",
    ),
    (
        "range of no width",
        OUT,
        "bits = 16\nrange = [3.0, 3.0]",
        "output.range must be rising, [low, high], not [3.0, 3.0]",
    ),
    (
        "range of three",
        VOLT,
        "bits = 16\nrange = [0.0, 5.0, 10.0]",
        "input.voltage.range must be a list of 2 numbers, not [0.0, 5.0, 10.0]",
    ),
    (
        "range of texts",
        VOLT,
        'bits = 16\nrange = [0.0, "10"]',
        "input.voltage.range[1] must be a number, not '10': write 10, without quotes and unit",
    ),
    (
        "range is a number",
        VOLT,
        "bits = 16\nrange = 10.0",
        "input.voltage.range must be a list of 2 numbers, not 10.0",
    ),
    (
        "infinite range",
        VOLT,
        "bits = 16\nrange = [0.0, inf]",
        "input.voltage.range[1] must be a finite number, not infinity",
    ),
    (
        "signed input off centre",
        VOLT,
        VOLT + "\nsigned = true",
        "input.voltage.range must be symmetric, [-high, high], where signed = true, not [0, 10]",
    ),
    (
        "signed output off centre",
        OUT,
        OUT + "\nsigned = true",
        "output.range must be symmetric, [-high, high], where signed = true, not [0, 16]",
    ),
    (
        "signed is a number",
        VOLT,
        VOLT + "\nsigned = 1",
        "input.voltage.signed must be true or false, not 1: write true",
    ),
    (
        "input is no table",
        "[input.voltage]\n" + VOLT + "\n" + TEMP,
        "[input]\nvoltage = 3\n",
        "input.voltage must be a table, not 3",
    ),
    (
        "input is a number",
        NAME + "\n" + RATE + "\n\n[input.voltage]\n" + VOLT + "\n" + TEMP,
        NAME + "\ninput = 3\n" + RATE + "\n",
        "input must be a table [input.NAME] per input, not 3",
    ),
    (
        "calibration of one input",
        TEMP,
        "",
        "input must be the two tables voltage and temperature with [calibration], not 'voltage'",
    ),
    (
        "calibration of another input",
        "[input.temperature]",
        "[input.temp]",
        "input must be the two tables voltage and temperature with [calibration], not 'voltage', 'temp'",
    ),
    (
        "two inputs without calibration",
        CAL,
        "",
        "input must be a single table if there is no [calibration], not 'voltage', 'temperature'",
    ),
    (
        "no input",
        "[input.voltage]\n" + VOLT + "\n" + TEMP + CAL,
        "[input]\n",
        "input must be a single table if there is no [calibration], not none",
    ),
    (
        "input name is a keyword",
        "[input.voltage]\n" + VOLT + "\n" + TEMP + CAL,
        "[input.wire]\n" + VOLT + "\n",
        f"input.wire must be named by {IDENTIFIER}, and no keyword of SystemVerilog, not 'wire'",
    ),
    (
        "input name is no identifier",
        "[input.voltage]\n" + VOLT + "\n" + TEMP + CAL,
        "[input.left-ear]\n" + VOLT + "\n",
        f"input.left-ear must be named by {IDENTIFIER}, not 'left-ear'",
    ),
    (
        "coefficients and data",
        COEF,
        COEF + '\ndata = "m.csv"',
        "calibration must be given by one of coefficients and data, not both",
    ),
    (
        "neither coefficients nor data",
        COEF + "\n",
        "",
        "calibration must be given by one of coefficients and data, not none of them",
    ),
    (
        "data is a list",
        COEF,
        'data = ["m.csv"]',
        "calibration.data must be the name of a file, not ['m.csv']",
    ),
    ("data is empty", COEF, 'data = ""', "calibration.data must be the name of a file, not ''"),
    (
        "no coefficients",
        COEF,
        "coefficients = []",
        "calibration.coefficients must be a list of 1 to 8 rows of 1 to 8 numbers, not []",
    ),
    (
        "empty row",
        COEF,
        "coefficients = [[1.0], []]",
        "calibration.coefficients[1] must be a list of 1 to 8 numbers, not []",
    ),
    (
        "flat coefficients",
        COEF,
        "coefficients = [1.0, 2.0]",
        "calibration.coefficients[0] must be a list of 1 to 8 numbers, not 1.0",
    ),
    (
        "coefficient is a text",
        COEF,
        'coefficients = [[1.0], [2.0, "x"]]',
        "calibration.coefficients[1][1] must be a number, not 'x'",
    ),
    (
        "coefficient is NaN",
        COEF,
        "coefficients = [[1.0, nan]]",
        "calibration.coefficients[0][1] must be a finite number, not nan",
    ),
    (
        "nine rows",
        COEF,
        "coefficients = [" + "[1.0]," * 9 + "]",
        "calibration.coefficients must be a list of 1 to 8 rows of 1 to 8 numbers, not a list of 9 values",
    ),
    (
        "nine columns",
        COEF,
        "coefficients = [[" + "1.0," * 9 + "]]",
        "calibration.coefficients[0] must be a list of 1 to 8 numbers, not a list of 9 values",
    ),
    (
        "coefficients all zero",
        COEF,
        "coefficients = [[0, 0.0], [0]]",
        "calibration.coefficients must be a polynomial that is not zero, not zeros only",
    ),
    ("unknown family", FAM, 'family = "gauss"', f"filter.family must be {FAMILIES}, not 'gauss'"),
    (
        "unknown kind",
        KIND,
        'kind = "low pass"',
        "filter.kind must be one of lowpass, highpass, bandpass, bandstop, not 'low pass' (did you mean lowpass?)",
    ),
    (
        "kind is a list",
        KIND,
        'kind = ["lowpass"]',
        "filter.kind must be one of lowpass, highpass, bandpass, bandstop, not ['lowpass']",
    ),
    (
        "impulse invariance of a high-pass",
        KIND,
        'kind = "highpass"\nmethod = "impulse_invariant"',
        "filter.kind must be lowpass with impulse_invariant, as everything that the analog filter passes above half"
        " the sample rate would alias, not 'highpass'",
    ),
    (
        "impulse invariance of a band-pass",
        KO,
        'kind = "bandpass"\nmethod = "impulse_invariant"\norder = 2\ncutoff = [10.0, 20.0]',
        "not yet available: filter.kind must be lowpass with impulse_invariant, not 'bandpass'",
    ),
    (
        "impulse invariance by edges",
        f"{FAM}\n{KO}",
        f'{FAM}\n{KIND}\nmethod = "impulse_invariant"\n' + EDGES.format(10.0, 45.0, 0.02, 60.0),
        "filter must be given by order and cutoff with impulse_invariant, as no formula for the minimum order"
        " covers its aliasing, not by edges",
    ),
    (
        "impulse invariance of an even elliptic filter",
        f"{FAM}\n{KO}",
        f'family = "elliptic"\n{KIND}\nmethod = "impulse_invariant"\npassband_loss = 0.5\nstopband_loss = 60\n'
        "order = 4\ncutoff = 10.0",
        "filter.order must be odd for elliptic with impulse_invariant, as the gain of an even one does not fall"
        " to zero, not 4",
    ),
    (
        "unknown method",
        KIND,
        KIND + '\nmethod = "matched_z"',
        "filter.method must be one of bilinear, impulse_invariant, not 'matched_z'",
    ),
    (
        "results held of no decimator",
        ORD,
        f"{ORD}\nhold = true",
        "filter.hold must be false without filter.decimate, as every sample has a result, not true",
    ),
    (
        "three samples a clock",
        CLOCK,
        CLOCK + "\nsamples_per_clock = 3",
        "hardware.samples_per_clock must be one of 1, 2, 4, 8, 16, not 3",
    ),
    (
        "true samples a clock",
        CLOCK,
        CLOCK + "\nsamples_per_clock = true",
        "hardware.samples_per_clock must be one of 1, 2, 4, 8, 16, not true",
    ),
    (
        "unknown pipeline",
        CLOCK,
        CLOCK + '\npipeline = "lookahead"',
        "hardware.pipeline must be one of auto, plain, look-ahead, not 'lookahead' (did you mean look-ahead?)",
    ),
    (
        "several samples a clock folded",
        CLOCK,
        CLOCK + '\nsamples_per_clock = 2\narchitecture = "folded"',
        "hardware.architecture must be 'auto' or 'parallel' with hardware.samples_per_clock = 2, as folded takes "
        "several clocks for each sample, not 'folded'",
    ),
    (
        "several samples a clock with loadable constants",
        CLOCK,
        CLOCK + "\nsamples_per_clock = 2\nreload = true",
        "not yet available: hardware.reload must be false with hardware.samples_per_clock = 2, not true",
    ),
    (
        "look-ahead with protection",
        CLOCK,
        CLOCK + '\npipeline = "look-ahead"\nprotect = "detect"',
        "not yet available: hardware.protect must be 'none' with hardware.pipeline = \"look-ahead\", not 'detect'",
    ),
    (
        "look-ahead of a realization",
        CLOCK,
        CLOCK + '\npipeline = "look-ahead"\nrealization = "df1"',
        "hardware.realization must be 'auto' with hardware.pipeline = \"look-ahead\", not 'df1'",
    ),
    (
        "look-ahead over no more samples than a beat",
        CLOCK,
        CLOCK + '\npipeline = "look-ahead"\nsamples_per_clock = 16',
        'hardware.samples_per_clock must be at most 8 with hardware.pipeline = "look-ahead", not 16',
    ),
    (
        "a factor that is no power of two",
        ORD,
        f"{ORD}\ndecimate = 12",
        'filter.decimate must be "auto", or a power of two from 2 to 1024, not 12',
    ),
    (
        "a word for a factor",
        ORD,
        f'{ORD}\ndecimate = "most"',
        "filter.decimate must be \"auto\", or a power of two from 2 to 1024, not 'most'",
    ),
    (
        "decimation to below four times the cutoff",
        ORD,
        f"{ORD}\ndecimate = 4",
        "filter.decimate must be at most 2, so that the cutoff is at most 1/4 of the lower sample rate, not 4",
    ),
    (
        "a cutoff too high for any decimation",
        OC,
        'order = 7\ncutoff = 20.0\ndecimate = "auto"',
        "filter.decimate must be left out, as the cutoff would be more than 1/4 of the lower sample rate, not 'auto'",
    ),
    (
        "decimation before a high-pass",
        KO,
        f'kind = "highpass"\n{OC}\ndecimate = 2',
        "filter.decimate must be left out for highpass, whose pass band would alias, not 2",
    ),
    (
        "decimation with impulse invariance",
        KO,
        f'{KO}\nmethod = "impulse_invariant"\ndecimate = 2',
        "not yet available: filter.decimate must be left out with impulse_invariant, not 2",
    ),
    (
        "decimation of a filter by its edges",
        OC,
        EDGES.format(10.0, 45.0, 0.02, 60.0) + "\ndecimate = 2",
        "not yet available: filter.decimate must be left out unless the filter is given by order and cutoff, not 2",
    ),
    (
        "decimation before on-line arithmetic",
        CLOCK,
        f'{CLOCK}\narchitecture = "online"\n{DECIMATED}',
        "not yet available: hardware.architecture must be one of 'auto', 'parallel', 'folded', 'serial' with "
        "filter.decimate, not 'online'",
    ),
    (
        "decimation of converters",
        CLOCK,
        f"{CLOCK}\n{DECIMATED}" + ADC.format("[0.0, 10.0]") + THERMOCOUPLE,
        "not yet available: converter must be left out with filter.decimate, not 'voltage', 'temperature'",
    ),
    ("order zero", ORD, "order = 0", "filter.order must be a whole number from 1 to 20, not 0"),
    ("order 21", ORD, "order = 21", "filter.order must be a whole number from 1 to 20, not 21"),
    (
        "order 11 of a band",
        KO,
        'kind = "bandpass"\norder = 11\ncutoff = [10.0, 20.0]',
        "filter.order must be at most 10 for bandpass, which doubles the order, not 11",
    ),
    ("cutoff at half the sample rate", CUT, "cutoff = 50", f"filter.cutoff must be {NYQUIST}, not 50"),
    ("cutoff above half the sample rate", CUT, "cutoff = 60.5", f"filter.cutoff must be {NYQUIST}, not 60.5"),
    ("cutoff zero", CUT, "cutoff = 0.0", f"filter.cutoff must be {NYQUIST}, not 0"),
    ("cutoff negative", CUT, "cutoff = -1e-3", f"filter.cutoff must be {NYQUIST}, not -0.001"),
    (
        "cutoff of a millionth",
        CUT,
        "cutoff = 9.9e-5",
        f"filter.cutoff must be {MARGIN} without filter.decimate, not 9.9e-05",
    ),
    (
        "cutoff of a millionth behind a decimator",
        CUT,
        "cutoff = 2.4e-5\ndecimate = 4",
        f"filter.cutoff must be {MARGIN}, not 2.4e-05".replace(
            "the sample_rate (0.0001 Hz)", "the sample_rate / 4 (2.5e-05 Hz)"
        ),
    ),
    (
        "cutoff just below half the sample rate",
        CUT,
        "cutoff = 49.99999",
        f"filter.cutoff must be {MARGIN}, not 49.99999",
    ),
    (
        "cutoff is a text",
        CUT,
        'cutoff = "10 Hz"',
        "filter.cutoff must be a number of Hz, or a list of 2 numbers for a band, not '10 Hz': "
        "write 10, without quotes and unit",
    ),
    (
        "two cutoffs of a low-pass",
        CUT,
        "cutoff = [1.0, 2.0]",
        "filter.cutoff must be one frequency for lowpass, not [1, 2]",
    ),
    (
        "one cutoff of a band",
        KIND,
        'kind = "bandstop"',
        "filter.cutoff must be two frequencies [low, high] for bandstop, not 10",
    ),
    (
        "three cutoffs",
        KO,
        'kind = "bandpass"\norder = 3\ncutoff = [1, 2, 3]',
        "filter.cutoff must be a list of 2 numbers, not [1, 2, 3]",
    ),
    (
        "falling cutoffs",
        KO,
        'kind = "bandpass"\norder = 3\ncutoff = [20.0, 10.0]',
        "filter.cutoff must be rising, [low, high], not [20, 10]",
    ),
    (
        "equal cutoffs",
        KO,
        'kind = "bandpass"\norder = 3\ncutoff = [20, 20.0]',
        "filter.cutoff must be rising, [low, high], not [20, 20]",
    ),
    (
        "ripple of a Butterworth",
        ORD,
        ORD + "\npassband_loss = 0.1",
        "filter.passband_loss must be left out with order and cutoff for butterworth, not 0.1",
    ),
    (
        "no ripple of a Chebyshev",
        FAM,
        'family = "chebyshev1"',
        "filter.passband_loss must be given in dB with order and cutoff for chebyshev1, not missing",
    ),
    (
        "no stopband loss of an inverse Chebyshev",
        FAM,
        'family = "chebyshev2"',
        "filter.stopband_loss must be given in dB with order and cutoff for chebyshev2, not missing",
    ),
    (
        "no stopband loss of an elliptic",
        FAM,
        'family = "elliptic"\npassband_loss = 0.1',
        "filter.stopband_loss must be given in dB with order and cutoff for elliptic, not missing",
    ),
    (
        "losses of an elliptic the wrong way round",
        FAM,
        'family = "elliptic"\npassband_loss = 60\nstopband_loss = 0.5',
        "filter.passband_loss must be below stopband_loss (0.5 dB), not 60",
    ),
    (
        "freedom without a mask",
        ORD,
        ORD + '\nfreedom = "mask"',
        "filter.freedom must be left out unless the filter is given by passband_edge, stopband_edge, passband_loss and "
        "stopband_loss, not 'mask'",
    ),
    (
        "no such freedom",
        ORD,
        ORD + '\nfreedom = "all"',
        "filter.freedom must be one of none, mask, not 'all'",
    ),
    (
        "order and cutoff beside edges",
        ORD,
        ORD + "\nstopband_edge = 3.0",
        f"filter must be {FORMS}, not by order, cutoff and stopband_edge",
    ),
    ("neither order nor edges", OC + "\n", "", f"filter must be {FORMS}, not by none of them"),
    (
        "losses alone",
        OC,
        "passband_loss = 0.1\nstopband_loss = 60.0",
        f"filter must be {FORMS}, not by passband_loss and stopband_loss",
    ),
    (
        "no stopband edge",
        OC,
        "passband_edge = 1.0\npassband_loss = 0.1\nstopband_loss = 60.0",
        "filter.stopband_edge must be given together with passband_edge, passband_loss and stopband_loss, not missing",
    ),
    (
        "no passband loss",
        OC,
        "passband_edge = 1.0\nstopband_edge = 2.0\nstopband_loss = 60.0",
        "filter.passband_loss must be given together with passband_edge, stopband_edge and stopband_loss, not missing",
    ),
    (
        "loss zero",
        OC,
        EDGES.format(10.0, 45.0, 0.0, 60.0),
        "filter.passband_loss must be a number of dB from 1e-06 to 200, not 0.0",
    ),
    (
        "loss of 300 dB",
        OC,
        EDGES.format(10.0, 45.0, 0.02, 300),
        "filter.stopband_loss must be a number of dB from 1e-06 to 200, not 300",
    ),
    (
        "losses the wrong way round",
        OC,
        EDGES.format(10.0, 45.0, 60.0, 0.02),
        "filter.passband_loss must be below stopband_loss (0.02 dB), not 60",
    ),
    (
        "equal losses",
        OC,
        EDGES.format(10.0, 45.0, 3.0, 3.0),
        "filter.passband_loss must be below stopband_loss (3 dB), not 3",
    ),
    (
        "equal edges of a low-pass",
        OC,
        EDGES.format(10.0, 10.0, 0.02, 60.0),
        "filter.passband_edge must be below stopband_edge (10 Hz) for lowpass, not 10",
    ),
    (
        "equal edges of a high-pass",
        KO,
        'kind = "highpass"\n' + EDGES.format(10.0, 10.0, 0.02, 60.0),
        "filter.passband_edge must be above stopband_edge (10 Hz) for highpass, not 10",
    ),
    (
        "equal low edges of a band-pass",
        KO,
        'kind = "bandpass"\n' + EDGES.format([10, 20], [10, 25], 0.02, 60.0),
        "filter.passband_edge must be inside stopband_edge ([10, 25] Hz) for bandpass, not [10, 20]",
    ),
    (
        "equal high edges of a band-pass",
        KO,
        'kind = "bandpass"\n' + EDGES.format([10, 20], [5, 20], 0.02, 60.0),
        "filter.passband_edge must be inside stopband_edge ([5, 20] Hz) for bandpass, not [10, 20]",
    ),
    (
        "equal low edges of a band-stop",
        KO,
        'kind = "bandstop"\n' + EDGES.format([10, 20], [10, 15], 0.02, 60.0),
        "filter.passband_edge must be around stopband_edge ([10, 15] Hz) for bandstop, not [10, 20]",
    ),
    (
        "equal high edges of a band-stop",
        KO,
        'kind = "bandstop"\n' + EDGES.format([10, 20], [15, 20], 0.02, 60.0),
        "filter.passband_edge must be around stopband_edge ([15, 20] Hz) for bandstop, not [10, 20]",
    ),
    (
        "edges of a low-pass the wrong way round",
        OC,
        EDGES.format(45.0, 10.0, 0.02, 60.0),
        "filter.passband_edge must be below stopband_edge (10 Hz) for lowpass, not 45",
    ),
    (
        "edges of a high-pass the wrong way round",
        KO,
        'kind = "highpass"\n' + EDGES.format(10.0, 45.0, 0.02, 60.0),
        "filter.passband_edge must be above stopband_edge (45 Hz) for highpass, not 10",
    ),
    (
        "edges of a band-pass not nested",
        KO,
        'kind = "bandpass"\n' + EDGES.format([10, 20], [5, 15], 0.02, 60.0),
        "filter.passband_edge must be inside stopband_edge ([5, 15] Hz) for bandpass, not [10, 20]",
    ),
    (
        "edges of a band-stop not nested",
        KO,
        'kind = "bandstop"\n' + EDGES.format([10, 20], [5, 25], 0.02, 60.0),
        "filter.passband_edge must be around stopband_edge ([5, 25] Hz) for bandstop, not [10, 20]",
    ),
    (
        "stopband edge above half the sample rate",
        OC,
        EDGES.format(10.0, 51.0, 0.02, 60.0),
        f"filter.stopband_edge must be {NYQUIST}, not 51",
    ),
    (
        "edges of a Bessel",
        FAM + "\n" + KIND + "\n" + OC,
        'family = "bessel"\nkind = "lowpass"\n' + EDGES.format(10.0, 45.0, 0.02, 60.0),
        "filter must be given by order and cutoff for bessel, which has no formula for the minimum order, not by edges",
    ),
    (
        "sections beside an order",
        ORD,
        ORD + "\nsos = [[1, 2, 1, 1, 0, 0]]",
        f"filter must be {FORMS}, not by order, cutoff and sos",
    ),
    (
        "sections beside a loss",
        OC,
        "passband_loss = 1\nsos = [[1, 2, 1, 1, 0, 0]]",
        "filter.passband_loss must be left out with sos, not 1",
    ),
    (
        "no section",
        OC,
        "sos = []",
        "filter.sos must be a list of 1 to 10 rows [b0, b1, b2, 1.0, a1, a2], not []",
    ),
    (
        "eleven sections",
        OC,
        "sos = [" + "[1, 2, 1, 1, 0, 0]," * 11 + "]",
        "filter.sos must be a list of 1 to 10 rows [b0, b1, b2, 1.0, a1, a2], not a list of 11 values",
    ),
    (
        "section of five numbers",
        OC,
        "sos = [[1, 2, 1, 1, 0, 0], [1, 2, 1, 0, 0]]",
        "filter.sos[1] must be a list of 6 numbers, not [1, 2, 1, 0, 0]",
    ),
    (
        "section with an infinite number",
        OC,
        "sos = [[1, 2, 1, 1, 0, inf]]",
        "filter.sos[0][5] must be a finite number, not infinity",
    ),
    (
        "section with a0 = 2",
        OC,
        "sos = [[1, 2, 1, 2, 0, 0]]",
        "filter.sos[0] must be a section with a0 = 1, not 2",
    ),
    (
        "section of zeros",
        OC,
        "sos = [[0, 0.0, 0, 1, 0.5, 0]]",
        "filter.sos[0] must be a section with at least one nonzero b, not b0 = b1 = b2 = 0",
    ),
    (
        "section with a pole at 1",
        OC,
        "sos = [[1, 2, 1, 1.0, -1.5, 0.5]]",
        f"filter.sos[0] must be {STABLE}, not a1 = -1.5, a2 = 0.5",
    ),
    (
        "section with poles on the circle",
        OC,
        "sos = [[1, 2, 1, 1, 0, 0], [1, 2, 1, 1.0, -1.5, 1.0]]",
        f"filter.sos[1] must be {STABLE}, not a1 = -1.5, a2 = 1",
    ),
    (
        "pole a hair outside",
        OC,
        "sos = [[1, 2, 1, 1, -1.00000000000000000000000000000000000001, 0]]",
        f"filter.sos[0] must be {STABLE}, not a1 = -1, a2 = 0",
    ),
    (
        "max_error of a third of an LSB",
        UNIT,
        UNIT + "\nmax_error = 8e-5",
        "output.max_error must be more than half an LSB of the output (0.0001220703125), which output"
        " rounding alone takes, not 8e-05",
    ),
    ("max_error zero", UNIT, UNIT + "\nmax_error = 0", f"output.max_error must be {MAX_ERROR}, not 0"),
    (
        "max_error unknown word",
        UNIT,
        UNIT + '\nmax_error = "exact"',
        f"output.max_error must be {MAX_ERROR}, not 'exact'",
    ),
    (
        "max_error is a list",
        UNIT,
        UNIT + "\nmax_error = [1.0]",
        f"output.max_error must be {MAX_ERROR}, not [1.0]",
    ),
    (
        "unit is a number",
        UNIT,
        "unit = 1",
        "output.unit must be a printable text of at most 16 characters, not 1",
    ),
    (
        "unit is long",
        UNIT,
        'unit = "millimetres of clearance"',
        "output.unit must be a printable text of at most 16 characters, not 'millimetres of clearance'",
    ),
    (
        "unknown realization",
        CLOCK,
        CLOCK + '\nrealization = "df3"',
        f"hardware.realization must be one of {', '.join(REALIZATIONS)}, not 'df3' (did you mean df1?)",
    ),
    (
        "unknown start",
        CLOCK,
        CLOCK + '\nstart = "warm"',
        "hardware.start must be one of steady, zero, not 'warm'",
    ),
    (
        "multipliers below zero",
        CLOCK,
        CLOCK + "\nmultipliers = -1",
        'hardware.multipliers must be "auto", or a whole number from 0 to 9999, not -1',
    ),
    (
        "no multipliers, but another word",
        CLOCK,
        CLOCK + '\nmultipliers = "none"',
        "hardware.multipliers must be \"auto\", or a whole number from 0 to 9999, not 'none'",
    ),
    (
        "no multipliers for loadable constants",
        CLOCK,
        CLOCK + '\nreload = true\nmultipliers = 0\narchitecture = "parallel"',
        "hardware.multipliers must be 'auto' with hardware.architecture = \"parallel\" and hardware.reload = true, as "
        "adders multiply by constants that are "
        "fixed, not 0",
    ),
    (
        "unknown architecture",
        CLOCK,
        CLOCK + '\narchitecture = "systolic"',
        "hardware.architecture must be one of auto, parallel, folded, serial, multiplexed, online, not 'systolic'",
    ),
    (
        "several channels digit by digit",
        BASE,
        BASE.replace(RATE, RATE + "\nchannels = 2").replace(CLOCK, CLOCK + '\narchitecture = "online"'),
        'not yet available: channels must be 1 with hardware.architecture = "online", not 2',
    ),
    (
        "constants loaded digit by digit",
        CLOCK,
        CLOCK + '\narchitecture = "online"\nreload = true',
        'not yet available: hardware.reload must be false with hardware.architecture = "online", not true',
    ),
    (
        "protection digit by digit",
        CLOCK,
        CLOCK + '\narchitecture = "online"\nprotect = "detect"',
        "not yet available: hardware.protect must be 'none' with hardware.architecture = \"online\", not 'detect'",
    ),
    (
        "online within a number of multipliers",
        CLOCK,
        CLOCK + '\narchitecture = "online"\nmultipliers = 0',
        "not yet available: hardware.multipliers must be 'auto' with hardware.architecture = \"online\", not 0",
    ),
    (
        "folded without a multiplier",
        CLOCK,
        CLOCK + '\narchitecture = "folded"\nmultipliers = 0',
        "hardware.multipliers must be 'auto' or at least 1 with hardware.architecture = \"folded\", as its program "
        "needs one, not 0",
    ),
    (
        "reload is a text",
        CLOCK,
        CLOCK + '\nreload = "yes"',
        "hardware.reload must be true or false, not 'yes': write true",
    ),
    (
        "clock below the sample rate",
        CLOCK,
        "clock = 99.0",
        "hardware.clock must be at least the sample_rate (100 Hz), not 99",
    ),
    ("clock zero", CLOCK, "clock = 0", "hardware.clock must be a positive number of Hz, not 0"),
    (
        "converter of one input only",
        CLOCK,
        CLOCK + ADC.format("[0, 10]"),
        "converter must be a table for each of the inputs voltage and temperature, or none, not 'voltage'",
    ),
    (
        "unknown converter",
        CLOCK,
        CLOCK + ADC.format("[0, 10]").replace("mcp3204", "mcp3208") + THERMOCOUPLE,
        f"converter.voltage.device must be one of {DEVICES}, not 'mcp3208' (did you mean mcp3204?)",
    ),
    (
        "converter without a range",
        CLOCK,
        CLOCK + "\n[converter.voltage]\ndevice = 'mcp3202'" + THERMOCOUPLE,
        "converter.voltage.range must be the values of the input at the readings 0 and 4096, [low, high], not missing",
    ),
    (
        "thermocouple converter with a range",
        CLOCK,
        CLOCK + ADC.format("[0, 10]") + THERMOCOUPLE + "\nrange = [0, 100]",
        "converter.temperature.range must be left out for max31855, not [0, 100]",
    ),
    (
        "thermocouple converter with a supply",
        CLOCK,
        CLOCK + ADC.format("[0, 10]") + THERMOCOUPLE + "\nsupply = 3.3",
        "converter.temperature.supply must be left out for max31855, not 3.3",
    ),
    (
        "supply that no converter stands",
        CLOCK,
        CLOCK + ADC.format("[0, 10]") + "\nsupply = 12" + THERMOCOUPLE,
        "converter.voltage.supply must be a number of V from 2.7 to 5.5, not 12",
    ),
    (
        "unknown key of a converter",
        CLOCK,
        CLOCK + ADC.format("[0, 10]") + "\nchannel = 1" + THERMOCOUPLE,
        "converter.voltage.channel must be one of the keys device, range, supply, not an unknown one",
    ),
    (
        "converter without a device",
        CLOCK,
        CLOCK + "\n[converter.voltage]\nrange = [0, 10]" + THERMOCOUPLE,
        f"converter.voltage.device must be one of {DEVICES}, not missing",
    ),
    (
        "converter of the output alone",
        CLOCK,
        CLOCK + "\n[converter.output]\ndevice = 'cs4344'",
        "converter must be a table for each of the inputs voltage and temperature, or none, not 'output'",
    ),
    (
        "ADC at the output",
        CLOCK,
        CLOCK + ADC.format("[0, 10]") + THERMOCOUPLE + "\n[converter.output]\ndevice = 'pcm1808'",
        "converter.output.device must be a DAC, one of pcm5102a, cs4344, mcp4921, not 'pcm1808'",
    ),
    (
        "DAC at an input",
        CLOCK,
        CLOCK + ADC.format("[0, 10]").replace("mcp3204", "cs4344") + THERMOCOUPLE,
        "converter.voltage.device must be an ADC, one of mcp3202, mcp3204, max31855, ad7476a, pcm1808, cs5343, not "
        "'cs4344'",
    ),
    (
        "audio converter with a supply",
        CLOCK,
        CLOCK + ADC.format("[0, 10]").replace("mcp3204", "pcm1808") + "\nsupply = 3.3" + THERMOCOUPLE,
        "converter.voltage.supply must be left out for pcm1808, not 3.3",
    ),
    (
        "output between words",
        CLOCK,
        CLOCK + ADC.format("[0, 10]") + THERMOCOUPLE + "\n[converter.output]\ndevice = 'cs4344'\nrange = [0.0, 10.0]",
        "converter.output must be one that has an LSB of clearance of a whole number of its steps, not of 409.6",
    ),
    (
        "steps between codes",
        CLOCK,
        CLOCK + ADC.format("[0, 3.3]") + THERMOCOUPLE,
        "converter.voltage must be one that has steps of a whole number of LSB of voltage, not of 5.28",
    ),
    (
        "zero between codes",
        CLOCK,
        CLOCK + ADC.format("[-0.0001, 9.9999]") + THERMOCOUPLE,
        "converter.voltage must be one that has its reading 0 at a code of voltage, not at -0.65536",
    ),
    (
        "far larger range",
        CLOCK,
        CLOCK + ADC.format("[0, 1e15]") + THERMOCOUPLE,
        "converter.voltage must be one that has a range of the size of that of voltage, not a far larger one",
    ),
    (
        "wear without its limit",
        UNIT,
        UNIT + "\n[wear]\ninitial = 1.5\nwarning = 7.0",
        "wear.limit must be a positive number in the unit of the output, not missing",
    ),
    (
        "no wear to warn of",
        UNIT,
        UNIT + "\n[wear]\ninitial = 1.5\nwarning = 0\nlimit = 9",
        "wear.warning must be a positive number in the unit of the output, not 0",
    ),
    (
        "initial clearance is a text",
        UNIT,
        UNIT + "\n[wear]\ninitial = '1.5'\nwarning = 7\nlimit = 9",
        "wear.initial must be a number in the unit of the output, or a list of one for each channel, not '1.5': "
        "write 1.5, without quotes and unit",
    ),
    (
        "initial clearances of other channels",
        UNIT,
        UNIT + "\n[wear]\ninitial = [1.5, 1.6]\nwarning = 7\nlimit = 9",
        "wear.initial must be one number, not [1.5, 1.6]",
    ),
    (
        "initial clearance that the output cannot show",
        UNIT,
        UNIT + "\n[wear]\ninitial = -0.5\nwarning = 7\nlimit = 9",
        "wear.initial must be in the range of the output, [0, 16], not -0.5",
    ),
    (
        "no initial clearance in the list",
        UNIT,
        UNIT + "\n[wear]\ninitial = []\nwarning = 7\nlimit = 9",
        "wear.initial must be a number in the unit of the output, or a list of one for each channel, not []",
    ),
    (
        "initial clearance beyond the output",
        UNIT,
        UNIT + "\n[wear]\ninitial = 16\nwarning = 7\nlimit = 9",
        "wear.initial must be in the range of the output, [0, 16], not 16",
    ),
    (
        "warning at the limit",
        UNIT,
        UNIT + "\n[wear]\ninitial = 1.5\nwarning = 9\nlimit = 9",
        "wear.warning must be below limit (9), not 9",
    ),
    (
        "warning and limit at one code",
        UNIT,
        UNIT + "\n[wear]\ninitial = 1.5\nwarning = 8.99999\nlimit = 9",
        "wear.warning must be at least an LSB of the output (0.000244140625) below limit, not 8.99999",
    ),
    (
        "limit beyond the output",
        UNIT,
        UNIT + "\n[wear]\ninitial = 8\nwarning = 7\nlimit = 9",
        "wear.limit must be at most 7.999755859375, so that the output can represent it, not 9",
    ),
    (
        "sensor blind before the warning",
        UNIT,
        UNIT + "\n[wear]\ninitial = 1.5\nwarning = 7\nlimit = 9\nsensor_range = 8.5",
        "wear.sensor_range must be above the clearance of the warning (8.5), not 8.5",
    ),
    (
        "filter is a list of tables",
        "[filter]",
        "[[filter]]",
        "filter must be a table [filter], not [a table]",
    ),
    (
        "syntax error",
        ORD,
        "order 7",
        "line 17 must be a key, an equals sign and a value: order = 7",
    ),
    (
        "key given twice",
        ORD,
        "order = 7\norder = 8",
        "line 18, column 10 must be valid TOML, not a syntax error: cannot overwrite a value",
    ),
    ("list without end", BASE, "a = [1, 2", "line 1 must be valid TOML, not a syntax error: unclosed array"),
    ("empty", BASE, "", "the specification must have keys, not be empty"),
    (
        "comments alone",
        BASE,
        "# nothing\n\n",
        "the specification must have keys, not be empty",
    ),
    ("whole number of 5000 digits", ORD, "order = " + "9" * 5000, f"{REASON}"),
    ("lists a thousand deep", ORD, "order = " + "[" * 5000, f"{REASON}"),
    ("large", BASE, BASE + "#" * 70000, "the specification must be at most 65536 bytes, not longer"),
]


def with_fault(old: str, new: str) -> str:
    """Return the good specification with `new` in place of `old`, which must be there once."""
    assert BASE.count(old) == 1
    text = BASE.replace(old, new)
    return text.replace(ORD, f"{ORD}\ndecimate = 2") if DECIMATED in text else text
