"""The choice of a decimation chain: limits of the whole, structures and their costs, and the cheapest proven one."""
