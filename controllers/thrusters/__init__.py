"""On/off thrusters: phase-plane laws, relays, pulses and allocation."""
