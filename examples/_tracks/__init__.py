"""Parts of the example track_fitting."""
