"""Derives again what a specification states, by code of its own: ports, calibration, and the ideal filter in balls."""
