"""`gear drive`: closes the loop from pictures to motion, and reports what a patch does to a car."""
