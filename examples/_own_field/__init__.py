"""Parts of the examples snapping_flaps, self_folding, bead_chain and hu_sheet."""
