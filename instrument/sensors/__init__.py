"""Emulated sensors: coil, thermocouple, analog-to-digital converters, and their faults."""
