"""The report of a co-simulation, its page and plots, and reports side by side."""
