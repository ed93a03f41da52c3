"""What callers hand in, checked and converted in one place: numbers with units, indices, tensors."""
