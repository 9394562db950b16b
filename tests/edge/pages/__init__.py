"""Pages of ours among strangers."""
