"""The closed loop: vehicle dynamics, scenarios, traffic that reacts, and the loop from pictures to motion."""
