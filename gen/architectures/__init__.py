"""Architectures of the hardware: one class each, registered once, with what a choice among them needs."""
