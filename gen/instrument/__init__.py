"""Plots and reports of calibration, wear and vehicle."""
