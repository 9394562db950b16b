"""What a design or a report says: facts with value, unit and sentence, in tables, rendered as text, HTML and JSON."""
