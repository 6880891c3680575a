"""The sensors: sampling, delay, noise and bias."""
