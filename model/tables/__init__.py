"""Tables from files: CSV with its rows checked, TOML with the keys of every table."""
