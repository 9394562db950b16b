"""Folds a datapath into a program: what is stored, what it is made of, and the sums that compute it."""
