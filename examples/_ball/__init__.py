"""Parts of the example ball_on_sheet."""
