"""Reads SystemVerilog strictly: what every tool reads alike, each construct with the one meaning of IEEE 1800."""
