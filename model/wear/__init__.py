"""Wear of the flange from records of clearance."""
