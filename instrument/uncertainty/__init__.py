"""The uncertainty budget of an instrument, from the sensor to its output."""
