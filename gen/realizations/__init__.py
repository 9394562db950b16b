"""Realizations of the ideal filter's sections as integer stages, one file for each family of structures."""
