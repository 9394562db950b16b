"""What can be loaded at run time: constants, registers, and the model of a swap between samples."""
