"""A method over a recording: layout, the loop, and what drives it in batch and live."""
