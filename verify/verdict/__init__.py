"""One verdict on a certificate: what it is held against, what is proven of it, and how much of what was asked for."""
