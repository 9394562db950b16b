"""Comparison of the paper's figures with ours."""
