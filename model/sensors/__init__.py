"""Emulated sensors: coil, thermocouple, what digitizes them, and their faults."""
