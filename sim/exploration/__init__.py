"""Many designs of one specification, on all cores or on a cluster, and the front of accuracy against cost."""
