"""From a configuration and its files to a recording; data sets by name."""
