"""The host of a board: the serial line, sessions of the protocol, a client, and what monitors with it."""
