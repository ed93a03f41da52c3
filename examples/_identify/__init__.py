"""The parts of examples/identify.py: the sheet and its measurement, the inverse problem, the report."""
