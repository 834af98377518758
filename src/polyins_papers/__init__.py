"""The published tables and figures of both papers, each by one function that runs the whole chain."""
