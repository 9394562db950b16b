"""What stands before a decimated filter: its decimator, and the calibration before that."""
