"""Calibration of section laws: sweeps of the finite-element cell, fit, and comparison with the actuator."""
