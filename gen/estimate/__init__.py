"""What a core takes: on an FPGA, estimated before synthesis, and of standard cells, before layout."""
