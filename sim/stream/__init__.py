"""What runs beside the simulated core: the bench, its rules and pace, its loops, and its hold on the core's pins."""
