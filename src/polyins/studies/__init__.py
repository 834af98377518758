"""Our own tables: measured figures, each by one function that runs the whole chain."""
