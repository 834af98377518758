"""What the commands do: compare, time, warm up, look at files, write configurations."""
