"""What a core takes on an FPGA, estimated before synthesis."""
