"""Events, in plain Python at up to 50 Hz: arming, modes, missions, fences, failsafes; the laws do what it asks."""
