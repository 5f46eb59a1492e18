"""The smallest force that a guard detects, by link, task and direction (`tauperp sensitivity`)."""
