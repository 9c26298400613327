"""Flight logs in ULog files: what is logged, when, and how it gets to the disk without holding up the flight."""
