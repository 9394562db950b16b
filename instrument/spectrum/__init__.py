"""Spectra of recorded signals, and the filter proposed from them."""
