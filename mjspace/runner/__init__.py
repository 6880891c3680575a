"""Runs: fly a scenario into a log, judge it, fly a log again."""
