"""Tops of boards: a core with its link, and what a particular board connects it to."""
