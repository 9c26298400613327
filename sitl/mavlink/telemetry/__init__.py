"""What the vehicle tells of itself: each message from a snapshot of one moment, and how often it is streamed."""
