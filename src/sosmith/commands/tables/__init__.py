"""The tables that commands print, one file per subject; a command imports its own when it prints."""
