"""Generated files: SystemVerilog, RTLIL, manifest, certificate."""
