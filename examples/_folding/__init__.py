"""Parts of the example folding."""
