"""The locomotive on its track: parameters, dynamics, motion, and the resulting clearance."""
