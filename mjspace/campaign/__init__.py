"""Campaigns: a scenario flown many times with dispersions, and how often it works."""
