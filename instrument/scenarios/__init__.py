"""Scenarios: input traces generated from a description, with their true values."""
