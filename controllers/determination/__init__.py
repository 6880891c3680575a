"""Attitude determination: estimates of attitude, rate and gyro bias from sensors."""
