"""Scenarios: input traces made from a description, with their truth."""
