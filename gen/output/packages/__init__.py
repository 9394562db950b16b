"""A core packed for other tools: what they read to build, simulate, drive and document it without sosmith."""
