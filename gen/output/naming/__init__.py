"""Names of nets, ports and modules in the texts of a core."""
