"""The virtual board: the netlist of a board's top, or the model of the board, behind a pseudo-terminal."""
