"""What ball_on_sheet.py is made of."""
