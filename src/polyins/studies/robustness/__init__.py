"""What faults do to every method: the error that they cost, whether the verdict says so, and what is named."""
