"""Reference targets before the sensor of a board."""
