"""The check of the hardware as problems for solvers: SMT-LIB of bit vectors, written by the verifier."""
