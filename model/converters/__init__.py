"""Converters with a serial interface, as ports of hardware: their data sheets, readings and schedules."""
