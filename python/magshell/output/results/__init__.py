"""Conversion of results to snapshots, tables and files."""
