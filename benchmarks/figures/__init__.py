"""Figures of the benchmarks: functions of a part's results, as they are in its JSON, that return a matplotlib Figure."""
