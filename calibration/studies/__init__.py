"""Comparisons that no product path needs."""

from calibration.studies.compare_laws import compare_candidates as compare_candidates
