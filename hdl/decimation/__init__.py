"""Decimators before a core: of one channel, or of many that share one."""
