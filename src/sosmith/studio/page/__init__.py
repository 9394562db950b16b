"""The page of the studio: its template, style and scripts."""
