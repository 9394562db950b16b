"""Stages of a datapath in the parallel architecture: each as pipelined hardware."""
