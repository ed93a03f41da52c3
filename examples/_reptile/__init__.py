"""Parts of the example reptile."""
