"""From the specification to files: design, word lengths, Verilog, C model, manifest, reports."""
