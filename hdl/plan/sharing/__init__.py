"""Which sections share hardware, and when each of them has its turn."""
