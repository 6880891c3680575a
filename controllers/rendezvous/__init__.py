"""Rendezvous: approach to another spacecraft, from relative navigation."""
