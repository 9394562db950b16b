"""What the hardware does about wrong bits in its memories and states."""

PROTECTIONS = ("none", "detect", "correct")
"""Nothing; detect one in a word; correct one in a word of memory and detect two."""
