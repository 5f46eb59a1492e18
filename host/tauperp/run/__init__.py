"""A scenario's run: fitted to the arm, judged, and told."""
