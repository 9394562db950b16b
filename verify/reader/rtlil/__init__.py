"""Reads the RTLIL of a core, and proves that its modules do what those of the SystemVerilog do."""
