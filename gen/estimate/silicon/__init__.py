"""Standard cells: what a core takes of silicon, before layout."""
