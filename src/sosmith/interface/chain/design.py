"""Designs of chains, and their uses: compute, generate, prove, simulate."""
