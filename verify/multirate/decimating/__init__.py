"""Proves FIR filters that decimate and take a sample at each clock."""
