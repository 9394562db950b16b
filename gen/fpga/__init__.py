"""FPGAs, boards, and the synthesis for them."""
