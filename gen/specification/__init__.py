"""The specification file: its shape, its values and its rules."""
