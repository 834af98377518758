"""From streams as they were recorded to one time base and a start."""
