"""A scenario, typed: its tables, how it is loaded and overridden, and what it names constructed."""
