"""Answers linear questions: response, buckling, vibration."""
