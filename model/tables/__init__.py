"""Tables from files: CSV with checked rows, TOML with checked keys."""
