"""Parts of the examples snapping_flaps and self_folding."""
