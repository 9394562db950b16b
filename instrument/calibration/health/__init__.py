"""Whether a sensor still behaves as its past measurements and its type say."""
