"""The smallest force that a guard can see, by link, task and direction (`tauperp sensitivity`)."""
