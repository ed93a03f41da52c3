"""Parts of the examples snapping_flaps, self_folding and bead_chain."""
