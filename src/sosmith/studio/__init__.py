"""The studio: a page where a filter is designed by looking. What it computes, the public interface computes."""
