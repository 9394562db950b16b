"""The designs of the sweep."""

REFUSED = (
    "lattice_wdf must have a filter that is half the sum or difference of two allpass filters, as Butterworth, "
    "Chebyshev and elliptic filters of odd order are, or a band-pass or band-stop made from one: choose an odd order "
    "or another realization"
)
