"""Scenario files for tests, as text."""

PLAIN = """
description = "a test"

[sensors.inductive]
noise = 0.01

[sensors.thermocouple]
noise = 4.0

[wear]
initial_clearance = 2.0
rate = 0.1

[[excerpt]]
day = 10
operation = "depot"
seconds = 60
temperature = 20.0
"""

CALIBRATION = """
[calibration]
days = [0, 1, 2.5]
clearances = [2, 5, 8]
temperatures = [20, 60]
repeats = 4
scatter = 0.3
"""

FAULT = """
[[excerpt.fault]]
sensor = "inductive"
kind = "stuck"
start = 20
seconds = 5
"""
