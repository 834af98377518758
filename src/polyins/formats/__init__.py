"""One file per format, readers and writers alike."""
