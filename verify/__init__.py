"""Proves a certificate again by another method; imports nothing of the house but its errors."""
