"""Certificates in Rocq: its kernel checks their claims again, by theories in `theories/` and data written from them."""
