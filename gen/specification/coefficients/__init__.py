"""Filters that other tools made: their files, read exactly, into second-order sections with scipy's signs."""
