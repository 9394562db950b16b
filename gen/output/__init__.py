"""Files that leave the house: SystemVerilog, RTLIL, manifest, certificate."""
