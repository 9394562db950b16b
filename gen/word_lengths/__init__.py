"""From a designed filter to a frozen datapath: word lengths are searched with estimates, then proven."""
