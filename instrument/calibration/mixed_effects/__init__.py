"""The mixed-effects model behind the Bayesian calibration: days, their drift, and their systematic errors."""
