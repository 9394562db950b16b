"""The commands of `sosmith`, one file for what belongs together; `sosmith.cli` gathers them."""
