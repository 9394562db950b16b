"""Specifications of small cores, for the checkers of the emitted hardware."""

STEADY_INSTRUMENT = """
name = "smooth"
sample_rate = 100.0
input.voltage = { bits = 12, range = [0.0, 10.0] }
input.temperature = { bits = 10, range = [0.0, 128.0] }
calibration.coefficients = [[1.16, -0.0036], [0.3672, 0.0006618], [0.05812]]
filter = { family = "butterworth", kind = "lowpass", order = 3, cutoff = 10.0 }
output = { bits = 12, range = [0.0, 16.0], unit = "mm", max_error = 0.01 }
"""
STEADY = """
name = "plain"
sample_rate = 100.0
input.x = { bits = 8, signed = true, range = [-1.0, 1.0] }
filter = { family = "butterworth", kind = "lowpass", order = 2, cutoff = 20.0 }
output = { bits = 8, signed = true, range = [-1.0, 1.0], unit = "", max_error = "faithful" }
"""
PLAIN = STEADY + 'hardware.start = "zero"\n'
INSTRUMENT = STEADY_INSTRUMENT + 'hardware.start = "zero"\n'
UNSIGNED = """
name = "plain"
sample_rate = 100.0
input.x = { bits = 16, range = [0.0, 1.0] }
filter = { family = "butterworth", kind = "lowpass", order = 3, cutoff = 10.0 }
output = { bits = 10, range = [0.0, 1.0], unit = "", max_error = 0.00390625 }
hardware.start = "zero"
"""
WIDE = """
name = "plain"
sample_rate = 100.0
input.x = { bits = 12, signed = true, range = [-1.0, 1.0] }
output = { bits = 24, signed = true, range = [-1.0, 1.0], unit = "", max_error = 0.0005 }
hardware.start = "zero"
[filter]
family = "elliptic"
kind = "lowpass"
order = 2
cutoff = 1.0
passband_loss = 0.1
stopband_loss = 60.0
"""
NARROW = """
name = "plain"
sample_rate = 100.0
input.x = { bits = 5, signed = true, range = [-1.0, 1.0] }
output = { bits = 4, signed = true, range = [-1.0, 1.0], unit = "", max_error = "faithful" }
hardware.start = "zero"
filter = { family = "elliptic", kind = "lowpass", order = 1, cutoff = 1.0, passband_loss = 0.1, stopband_loss = 40.0 }
"""
