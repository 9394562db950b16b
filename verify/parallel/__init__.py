"""Proves that the SystemVerilog of a parallel core computes the graph of its certificate."""
