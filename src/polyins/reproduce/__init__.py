"""Published and measured figures, each as one function that runs the whole chain."""
