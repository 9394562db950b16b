"""Calibration: measurements, the polynomial fitted to them, and the quality of the fit."""
