"""From measurements to the calibration polynomial, and how good it is."""
