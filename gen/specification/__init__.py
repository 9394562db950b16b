"""The specification file: its shape, its values, its rules."""
