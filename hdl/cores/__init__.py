"""The cores: parallel, of several samples a clock, and the folded one; each with the shell around it."""
