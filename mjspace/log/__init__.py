"""The log: one MCAP file for each run, written as it flies and read back."""
