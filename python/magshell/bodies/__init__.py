"""Sheets with thickness and material, and what results say of each."""
