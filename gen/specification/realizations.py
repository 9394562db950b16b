"""The terms of the realizations: what a specification can name, and what is said of each.

`sosmith.gen.realizations.registry` says how each is built.
"""

from __future__ import annotations

from typing import NamedTuple


class RealizationTerms(NamedTuple):
    """What is said of one way to compute a filter.

    Attributes
    ----------
    name : str
        As in the specification.
    title : str
        Short description.
    feedback_order : int or None
        Order of its error feedback, where that is all it differs in from others, so that they can be compared at the
        same word lengths; None otherwise.
    """

    name: str
    title: str
    feedback_order: int | None = None


DF1 = RealizationTerms("df1", "direct form I", 0)
DF1_EF1 = RealizationTerms("df1_ef1", "direct form I, first-order error feedback", 1)
DF1_EF2 = RealizationTerms("df1_ef2", "direct form I, second-order error feedback", 2)
DF2T = RealizationTerms("df2t", "transposed direct form II")
DELTA = RealizationTerms("delta", "transposed direct form II, delta operator")
STATE_SPACE = RealizationTerms("state_space", "state space with minimum roundoff noise")
NORMAL = RealizationTerms("normal", "normal form with truncated magnitudes, free of limit cycles")
LATTICE_WDF = RealizationTerms("lattice_wdf", "lattice wave digital filter, free of limit cycles")
FIR_DIRECT = RealizationTerms("fir_direct", "direct form FIR, a product for each tap")
FIR_SYMMETRIC = RealizationTerms("fir_symmetric", "direct form FIR, equal taps added before their product")
FIR_TRANSPOSED = RealizationTerms("fir_transposed", "transposed direct form FIR, a product for each magnitude of taps")

FIR = (FIR_DIRECT, FIR_SYMMETRIC, FIR_TRANSPOSED)
"""Those of filters without poles, of any length; all others are of second-order sections."""

ALL = (DF1, DF1_EF1, DF1_EF2, DF2T, DELTA, STATE_SPACE, NORMAL, LATTICE_WDF, *FIR)
"""All that a specification can name, in the order in which lists show them."""
