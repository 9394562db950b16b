"""The columns of a record of clearances: names of times and of clearances, and their units."""

TIMES = {"date": 1.0, "days": 1.0, "time_days": 1.0, "time_d": 1.0, "hours": 1 / 24, "time_h": 1 / 24}
"""Columns that may hold the time, and the days of one unit of them; time_s too, of which 86400 are a day."""

CLEARANCES = ("hardware_mm", "measured_mm", "clearance_mm")
"""Columns that may hold the clearance in mm, the first that is there."""
