"""Processes that are killed, or run in a hostile environment."""
