"""From a designed filter to a frozen datapath: word lengths searched by estimates, then proven."""
