"""The serial link of a board: bytes on a line, frames of bytes, and what the frames ask of a core."""
