"""What is fixed of a core before it is made: pipeline stages, clocks, fields on its buses. Without Amaranth."""
