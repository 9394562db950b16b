"""The figures of a report, and how they are kept for the next one of the same run."""
