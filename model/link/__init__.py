"""The serial link between a host and a board: its messages, their frames, and a model of the board's end."""
