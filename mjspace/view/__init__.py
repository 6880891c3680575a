"""Views in a browser: a log replayed, a scenario flown live, and a replay in one HTML file."""
