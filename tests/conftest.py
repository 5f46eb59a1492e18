"""Settings of every test run."""

import signal

# A shell starts its background jobs with SIGINT ignored, and children inherit that. Tests press Ctrl-C.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)
