"""The public Python interface, one file a subject; `sosmith` itself hands out its names."""
