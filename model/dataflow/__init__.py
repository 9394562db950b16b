"""Dataflow graphs and datapaths, and what runs them: interpreter, C model, program for one multiply-accumulate unit."""
