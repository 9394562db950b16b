"""What the store of measurements is made of: its tables, what a file must not look like, what was withdrawn."""
