"""The polynomial of a specification that names measurements: an exact least-squares fit."""
