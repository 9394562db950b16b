"""The locomotive on its track: parameters, dynamics, motion, and the clearance that follows."""
