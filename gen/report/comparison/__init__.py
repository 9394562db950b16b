"""Accuracy reports side by side: what differs, who wins where that is fair, and what is worse than a baseline."""
