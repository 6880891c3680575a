"""Flights in phases, under one law after another."""
