"""What designs and reports say of themselves, in tables of texts that a terminal or a notebook shows."""
