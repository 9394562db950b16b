"""What stands around every core: streams, registers, status, and the way of a sample through a pipeline."""
