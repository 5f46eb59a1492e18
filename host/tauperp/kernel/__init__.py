"""The compiled campaign kernel (host/kernel) on numpy arrays: thousands of simulated runs in one call."""
