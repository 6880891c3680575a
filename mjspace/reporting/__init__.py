"""Reports: one HTML file each, with interactive plots, which opens without a network."""
