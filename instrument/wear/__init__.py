"""Flange wear from clearance records."""
