"""Bus logs through the same firmware, bit for bit."""
