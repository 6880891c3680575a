"""The simulation: everything that flies, assembled, and the loop that flies it."""
