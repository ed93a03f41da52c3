"""What examples/identify.py is made of: the sheet and its measurement, the inverse problem, the report."""
