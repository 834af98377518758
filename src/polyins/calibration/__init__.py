"""What a drive tells of the clocks, the wheels and the mounting of its sensors."""
