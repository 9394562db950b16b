"""The edge of the house: what comes from outside lies, and nothing is lost, mixed up or let in."""
