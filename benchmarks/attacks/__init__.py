"""Attacks on `sosmith verify`: wrong texts and certificates by the thousand, and three tools as witnesses."""
