"""The figures of the bench: functions of a part's results, as they stand in its JSON, that return a matplotlib Figure."""
