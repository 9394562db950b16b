"""Co-simulation of the generated SystemVerilog: simulators, cocotb benches, the runs they make."""
