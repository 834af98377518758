"""What is wrong with data, in the user's words."""
