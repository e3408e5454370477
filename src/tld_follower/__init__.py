"""Find, follow and never touch: a drone that follows a target it was shown once."""
