"""The commands of `sosmith`, one file for each group of related commands; `sosmith.cli` lists them."""
