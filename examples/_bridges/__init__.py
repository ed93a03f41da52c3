"""What examples/bridges.py is made of: shapes, the search, what data say of the field, pictures."""
