"""Amaranth components: datapath stages, the cores made of them, their AXI4-Stream and AXI4-Lite interfaces."""
