"""The double-precision golden chain, and the measures that hold the hardware against it."""
