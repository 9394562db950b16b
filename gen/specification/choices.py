"""Valid names in a specification: of its filter, its hardware, and its cores and inputs.

Those of `hardware.protect` are in `sosmith.model.dataflow.protection`.
"""

from fractions import Fraction

from sosmith.gen.specification import realizations
from sosmith.gen.specification.combinations import TERMS

AUTO = "auto"
"""Value of a key that leaves the choice to the design."""

FAMILIES = ("butterworth", "chebyshev1", "chebyshev2", "elliptic", "bessel")
FIR = "fir"
"""Family of filters that are given by their taps."""

FIR_FAMILIES = ("equiripple", "least_squares", "kaiser", "halfband")
"""Methods by which an FIR filter is designed from its edges and losses."""

MAX_TAPS = 256
"""Most taps of an FIR filter that is designed from its edges and losses."""

MAX_GIVEN_TAPS = 512
"""Most taps of one that is given by them."""

FAMILY_HINTS = {
    **dict.fromkeys(("fir", "firwin", "remez", "window", "hamming"), " (did you mean equiripple or kaiser?)"),
    "cauer": " (did you mean elliptic?)",
    "ellip": " (did you mean elliptic?)",
    "butter": " (did you mean butterworth?)",
}
"""What to say to names of families that there are elsewhere."""

KINDS = ("lowpass", "highpass", "bandpass", "bandstop")
_OTHER_KINDS = (("lp", "lpf", "low"), ("hp", "hpf", "high"), ("bp", "bpf"), ("bs", "notch"))
KIND_HINTS = {
    other: f" (did you mean {kind}?)" for kind, others in zip(KINDS, _OTHER_KINDS, strict=True) for other in others
}
"""What to say to other names of kinds."""
LOSSES = {
    "chebyshev1": ("passband_loss",),
    "chebyshev2": ("stopband_loss",),
    "elliptic": ("passband_loss", "stopband_loss"),
}
"""Losses that a family needs in addition to order and cutoff: they set the size of its ripples."""

FREEDOMS = ("none", "mask")
"""What a filter by edges and losses may be: that of its family, or any inside the mask."""

METHODS = ("bilinear", "impulse_invariant")
REALIZATIONS = (AUTO, *(each.name for each in realizations.ALL))
STARTS = ("steady", "zero")
ARCHITECTURES = (AUTO, *TERMS)
PIPELINES = (AUTO, "plain", "look-ahead")
SAMPLES_PER_CLOCK = (1, 2, 4, 8, 16)
LOOK_AHEAD = (2, 3, 4, 6, 8, 12, 16)
"""Samples over which recursions can look ahead: more than a beat holds."""

CORES = ("instrument", "filter", "calibration")
"""What can be generated from a specification: the whole instrument, or one part."""

ERROR_FEEDBACK = tuple(each.name for each in realizations.ALL if each.feedback_order is not None)
"""Realizations that differ only in their error feedback, so that they can be compared at the same word lengths."""

CALIBRATION_INPUTS = ("voltage", "temperature")
"""Inputs of the calibration polynomial, in the order of its indices."""

MAX_DECIMATION = 1024
"""Largest factor by which samples are decimated before a filter; all are powers of two."""

MAX_DOWNSAMPLING = 64
"""Largest factor by which an FIR filter decimates."""

MAX_RATIO = Fraction(1, 4)
"""Largest cutoff behind a decimator, as a share of the lower sample rate."""
