"""Front-ends of boards: they read converters, feed the core, and keep its results for the link."""
