"""Results as states of sheets, to be drawn and written."""
