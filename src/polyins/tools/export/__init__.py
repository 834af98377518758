"""Solutions as files that other programs open: one file per format, and one table of them."""
