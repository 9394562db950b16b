"""On-line arithmetic: sections that work on signed digits, the most significant first."""
