"""Chains of stages: specification, design, certificate."""
