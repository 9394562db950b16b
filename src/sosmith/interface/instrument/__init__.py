"""The instrument around a filter: wear by its readings, and the paper that it comes from."""
