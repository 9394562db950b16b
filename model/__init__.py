"""Bit-true arithmetic: ports, dataflow graphs, sections, and the double-precision reference."""
