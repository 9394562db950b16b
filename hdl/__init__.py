"""Amaranth components: datapath stages, cascades and the AXI4-Stream faces around them."""
