"""Control laws, allocation and references: flight software, which imports no simulator."""
