"""How a section of the ideal filter becomes a stage of integers, one file for each family of structures."""
