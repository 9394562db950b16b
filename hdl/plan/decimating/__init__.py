"""Plans of cores that decimate and take a sample at each clock."""
