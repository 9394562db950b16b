"""Everything around a core that filters at a lower rate, proven from its SystemVerilog."""
