"""The actuators: what a command makes the motors, thrusters and coils do, and their faults."""
