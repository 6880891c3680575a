"""Its presence puts this folder on the path: ``from oracle import fly`` works in every test."""
