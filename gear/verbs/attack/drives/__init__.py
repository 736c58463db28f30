"""`gear attack --drive`: attacks on the closed loop, in which a patch is judged by what happens to the car."""
