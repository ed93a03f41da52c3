"""Turns results into snapshots, tables and files."""
