"""Column names in a record of clearances, for times and clearances, and their units."""

TIMES = {"date": 1.0, "days": 1.0, "time_days": 1.0, "time_d": 1.0, "hours": 1 / 24, "time_h": 1 / 24}
"""Columns that can hold the time, and their unit in days; time_s is another one, in seconds."""

CLEARANCES = ("hardware_mm", "measured_mm", "clearance_mm")
"""Columns that can hold the clearance in mm; the first one present is used."""
