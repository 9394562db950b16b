"""The tables that commands print, one file a subject; a command loads its own when it has something to print."""
